#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pointflight/lidar/lidar.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/sim/simulation.hpp"
#include "pointflight/vehicle/step_response.hpp"

namespace pointflight::apps {

/// A top and a side view of a map, coloured by height. Throws InputError if it cannot be written.
void draw_map(const SurfelMap& map, const std::string& title, const std::string& path);

/// Range over azimuth and elevation, one mark a beam; beams without a return stay dark.
void draw_scan(const std::vector<Beam>& beams,
               const Scan& scan,
               const LidarSettings& lidar,
               const std::string& path);

/// What a picture of a run shows, collected while the run goes on or read from its files.
class RunPicture : public SampleSink {
 public:
  void on_state(const StateSample& sample) override;
  void on_scan(const Scan& scan, const PoseAt& pose_at) override;
  void on_collision(const CollisionEvent& event) override;
  void on_obstacle(const ObstacleSample& sample) override;

  void add_path_point(std::size_t vehicle, const Vector3d& p_world);
  void add_seen(const Vector3d& p_world);
  void add_obstacle(std::uint32_t label, const Vector3d& p_world, double radius);

  /// Where an obstacle went; a new trace where it was replaced.
  struct Trace {
    std::uint32_t label = 0;
    double radius = 0.0;
    std::vector<Vector3d> points;
  };
  std::vector<std::vector<Vector3d>> paths;      ///< Of each vehicle.
  std::vector<std::vector<Vector3d>> waypoints;  ///< Of each vehicle.
  std::vector<Vector3d> seen;                    ///< Measured points of the map, some of them.
  std::vector<Vector3d> seen_moving;             ///< Measured points of bodies.
  std::vector<Vector3d> collisions;
  std::vector<Trace> traces;
  std::string title, subtitle;

 private:
  std::size_t seen_offered_ = 0;
};

/// Titles and waypoints of a run that has ended.
void describe_run(const Simulation& simulation, RunPicture& picture);

/// Top and side view of map, flown paths, obstacles, waypoints and what the LiDARs saw.
void draw_overview(const SurfelMap& map, const RunPicture& run, const std::string& path);

/// A vehicle's step responses beside what its loops were designed for.
void draw_step_responses(const VehicleSettings& vehicle,
                         const std::vector<StepResponse>& responses,
                         const std::string& path);

}  // namespace pointflight::apps
