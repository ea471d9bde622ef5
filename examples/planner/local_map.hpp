// What a planner knows of its surroundings: cells around the vehicle that the LiDAR has seen
// filled, and the things among them that move.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace planner {

using pointflight::Pose;
using pointflight::Vector3d;

/// A measured point and where its beam came from, world frame.
struct SeenPoint {
  Vector3d origin, point;
};

/// Something that moves: a ball around points that appeared if there was nothing.
struct Mover {
  Vector3d center;
  Vector3d velocity = Vector3d::Zero();
  double radius = 0.3;
  double last_seen = 0.0;  ///< s
  /// Where it was seen over the last second: edges of bushes that come into sight go nowhere.
  std::vector<std::pair<double, Vector3d>> track;
  bool moves = false;

  [[nodiscard]] Vector3d at(double time) const { return center + (time - last_seen) * velocity; }
};

/// A grid that moves with the vehicle: filled and free cells from scans, the distance to the
/// nearest filled cell, and movers with their velocities.
class LocalMap {
 public:
  static constexpr double kCell = 0.15;                        ///< m
  static constexpr std::array<int, 3> kSize = {128, 128, 32};  ///< Cells.

  /// Takes a scan's points, measured at `time` (s) around `center`.
  void add_scan(const std::vector<SeenPoint>& points, const Vector3d& center, double time);

  /// Distance from a cell to the nearest filled one that stands still, at most 3 m; 0 outside.
  [[nodiscard]] double distance(const Vector3d& p) const;
  /// The same between the centres of cells.
  [[nodiscard]] double distance_between(const Vector3d& p) const;

  [[nodiscard]] bool contains(const Vector3d& p) const;
  /// True if a scan has seen something there, or that nothing is; for positions inside.
  [[nodiscard]] bool is_known(const Vector3d& p) const;
  /// Those that were seen to move.
  [[nodiscard]] const std::vector<Mover>& movers() const { return movers_; }

  /// Flat index of a cell, and its centre.
  [[nodiscard]] std::size_t index_of(const Vector3d& p) const;
  [[nodiscard]] Vector3d center_of(std::size_t index) const;
  /// The same cell whatever the vehicle's position: for what is remembered of the world.
  [[nodiscard]] static std::uint64_t key_of(const Vector3d& p);
  [[nodiscard]] std::size_t size() const { return score_.size(); }

 private:
  void move_to(const Vector3d& center);
  [[nodiscard]] bool is_beside_filled(const Vector3d& p) const;
  void find_movers(const std::vector<Vector3d>& fresh, double time);
  void measure_distances();

  std::array<std::int64_t, 3> low_{};  ///< World cell number of the grid's first cell.
  std::vector<std::int8_t> score_;     ///< Above 0: filled.
  std::vector<std::uint8_t> free_;     ///< Scans in a row that saw through it.
  std::vector<float> distance_;
  std::vector<Mover> candidates_;
  std::vector<Mover> movers_;
};

}  // namespace planner
