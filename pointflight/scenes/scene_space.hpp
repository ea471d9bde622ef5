// Where something fits that flies through an exact scene, and what of it can be reached.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/scenes/exact_scene.hpp"

namespace pointflight {

/// What flies, and where.
struct SpaceOptions {
  double radius = 0.35;     ///< Of what flies, with reserve for what a cell leaves open, m.
  double low = 1.0;         ///< Least height above what is below, m.
  double high = 2.5;        ///< Greatest, m.
  double cell = 0.1;        ///< Of the grid, m; larger in large scenes.
  double cells_max = 16e6;  ///< Of the grid.
};

/// A grid over the part of a scene where sensors may stand (`ExactScene::free`), with the distance
/// to the nearest surface, panes of glass included, and the largest part that is connected.
/// Distances hold to within a cell. The same for any number of threads.
class SceneSpace {
 public:
  /// A cell by its number along x, y, z.
  using Index3 = std::array<int, 3>;
  static constexpr int kReach = 20;  ///< Cells up to which distances are told apart.

  /// Throws InputError if nothing of `options.radius` fits anywhere at flight height.
  SceneSpace(const ExactScene& scene, const SpaceOptions& options, const Executor& executor);

  /// As they were given, with the width of cells as it is.
  [[nodiscard]] const SpaceOptions& options() const { return options_; }
  [[nodiscard]] double cell() const { return options_.cell; }  ///< m
  [[nodiscard]] const Index3& size() const { return size_; }   ///< Cells along x, y, z.
  /// Number of cells; each has an index below it, x fastest.
  [[nodiscard]] std::size_t count() const { return squared_.size(); }

  /// Index of a cell of the grid.
  [[nodiscard]] std::size_t flat(const Index3& cell) const;
  /// Cell of an index.
  [[nodiscard]] Index3 index3(std::size_t at) const;
  /// World, m.
  [[nodiscard]] Vector3d center(std::size_t at) const;
  /// The cell that a position (world, m) lies in, the nearest one for those outside.
  [[nodiscard]] std::size_t cell_of(const Vector3d& p_world) const;

  /// Room around a cell's centre: distance to the nearest surface, at most `kReach` cells, m.
  [[nodiscard]] double clearance(std::size_t at) const;
  /// The same of the straight line between two positions (world, m).
  [[nodiscard]] double clearance(const Vector3d& from, const Vector3d& to) const;
  /// Height of a cell above what is below, m; negative if nothing is.
  [[nodiscard]] double height(std::size_t at) const;
  /// Whether it belongs to the largest part, in which what flies gets from anywhere to anywhere.
  [[nodiscard]] bool is_reachable(std::size_t at) const { return reachable_[at]; }
  /// The same at flight height (`low` to `high`).
  [[nodiscard]] bool is_flyable(std::size_t at) const;

  /// Of all that can be reached, m^3.
  [[nodiscard]] double reachable_volume() const;
  /// Of the floor plan (each surface with a cell at flight height above it where sensors may stand,
  /// storey by storey, tables and the inside of lorries too) the part over which something can fly.
  [[nodiscard]] double flyable_share() const;

 private:
  void mark_surfaces(const ExactScene& scene);
  void measure(const Executor& executor);
  void measure_heights();
  [[nodiscard]] std::vector<std::uint32_t> part_of(std::size_t start,
                                                   std::vector<bool>& seen) const;
  void choose_part(const std::string& scene);
  [[nodiscard]] bool fits(std::size_t at) const;
  [[nodiscard]] bool is_surface(std::size_t at) const { return squared_[at] == 0; }

  SpaceOptions options_;
  Aabb free_;                           ///< Where sensors may stand.
  Vector3d low_ = Vector3d::Zero();     ///< Corner of the first cell, world, m.
  Index3 size_{};                       ///< Cells.
  std::vector<std::uint16_t> squared_;  ///< Distance to the nearest surface in cells, squared.
  std::vector<std::int16_t> height_;    ///< Cells above what is below; negative: nothing is.
  std::vector<bool> reachable_;
};

}  // namespace pointflight
