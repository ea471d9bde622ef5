#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pointflight/lidar/lidar.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/sim/simulation.hpp"

namespace pointflight::apps {

/// A top and a side view of a map, coloured by height. Throws InputError if it cannot be written.
void draw_map(const SurfelMap& map, const std::string& title, const std::string& path);

/// Range over azimuth and elevation, one mark a beam; beams without a return stay dark.
void draw_scan(const std::vector<Beam>& beams,
               const Scan& scan,
               const LidarSettings& lidar,
               const std::string& path);

/// Collects what `draw_overview` needs while a run goes on.
class OverviewSink : public SampleSink {
 public:
  void on_state(const StateSample& sample) override;
  void on_scan(const Scan& scan, const PoseAt& pose_at) override;
  void on_collision(const CollisionEvent& event) override;

  [[nodiscard]] const std::vector<Vector3d>& path() const { return path_; }
  [[nodiscard]] const std::vector<Vector3d>& points() const { return points_; }
  [[nodiscard]] const std::vector<Vector3d>& collisions() const { return collisions_; }

 private:
  std::vector<Vector3d> path_;
  std::vector<Vector3d> points_;
  std::vector<Vector3d> collisions_;
};

/// Top and side view of map, flown path, waypoints and what the LiDAR saw.
void draw_overview(const SurfelMap& map,
                   const Simulation& simulation,
                   const OverviewSink& run,
                   const std::string& path);

}  // namespace pointflight::apps
