// A small local planner: scans in, a smooth trajectory out, again with every scan. A* through the
// cells that the LiDAR has seen around the vehicle, then a B-spline that starts from the present
// motion and ends at rest within what is known.
#pragma once

#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "examples/planner/local_map.hpp"
#include "pointflight/vehicle/trajectory.hpp"

namespace planner {

struct PlannerOptions {
  double radius = 0.26;       ///< Of the vehicle, m.
  double speed = 2.0;         ///< m/s
  double acceleration = 2.0;  ///< m/s^2
  pointflight::Aabb fence;    ///< Which the flight does not leave, world, m.
};

class Planner {
 public:
  Planner(const PlannerOptions& options, const Vector3d& goal) : options_(options), goal_(goal) {}

  /// Takes a scan and plans from the present motion (`now`, time in s). Nothing if the
  /// trajectory that is flown is still the best.
  std::shared_ptr<const pointflight::Trajectory> update(const std::vector<SeenPoint>& points,
                                                        const pointflight::PositionCommand& now,
                                                        double time);

  /// Another goal from here on.
  void fly_to(const Vector3d& goal);

  [[nodiscard]] const LocalMap& map() const { return map_; }

 private:
  [[nodiscard]] std::vector<Vector3d> search(const Vector3d& from, double time);
  [[nodiscard]] double left(const Vector3d& p) const;
  void learn(const std::vector<std::size_t>& visited,
             const std::vector<float>& cost,
             double estimate);
  [[nodiscard]] std::vector<Vector3d> shortened(const std::vector<Vector3d>& path,
                                                double time) const;
  [[nodiscard]] std::shared_ptr<const pointflight::Trajectory> spline(
      const std::vector<Vector3d>& path,
      const pointflight::PositionCommand& now,
      double speed) const;
  /// Least room of a trajectory from `skip` seconds on, m: negative if it touches.
  [[nodiscard]] double room(const pointflight::Trajectory& trajectory,
                            double time,
                            double skip) const;
  [[nodiscard]] double room_with(double distance,
                                 const Vector3d& p,
                                 double time,
                                 double ahead) const;
  [[nodiscard]] double room_at(const Vector3d& p, double time, double ahead) const;
  [[nodiscard]] std::shared_ptr<const pointflight::Trajectory> escape(
      const pointflight::PositionCommand& now, double time) const;

  PlannerOptions options_;
  Vector3d goal_;
  LocalMap map_;
  /// How far the goal is at least from cells that were searched, m, by `LocalMap::key_of`: what
  /// leads out of a dead end, when the map has forgotten it.
  std::unordered_map<std::uint64_t, float> learned_;
  std::shared_ptr<const pointflight::Trajectory> flown_;
  double flown_since_ = 0.0;
};

}  // namespace planner
