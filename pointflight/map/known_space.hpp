// Which space a survey saw. What no ray of it crossed may hold anything.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Cubes in rows: cell (0, 0, 0) has a corner in the frame's origin, x runs fastest.
struct CellGrid {
  double cell = 1.0;                    ///< Width of a cell, m.
  Pose T_world_grid;                    ///< The grid's frame in the world.
  std::array<std::uint32_t, 3> size{};  ///< Cells along x, y, z.

  /// Number of cells.
  [[nodiscard]] std::uint64_t count() const { return std::uint64_t{size[0]} * size[1] * size[2]; }
  /// Of the cell that holds a point in the world; nothing outside the grid, and for NaN.
  [[nodiscard]] std::optional<std::uint64_t> index_of(const Vector3d& point_world) const;
  /// In the world, m.
  [[nodiscard]] Vector3d center_of(std::uint64_t index) const;
};

/// The cells of a grid that rays of a survey crossed or ended in. Beside a map it lies as the
/// section `known_space`: cell width, position and size of the grid, then a bit for each cell.
class KnownSpace {
 public:
  /// Of sections in a map file.
  static constexpr const char* kSection = "known_space";

  /// A view of a section's bytes, which must outlive it; nullopt if they are malformed.
  static std::optional<KnownSpace> from_section(std::span<const std::byte> section);

  /// True if the survey saw the point's cell; false outside the grid.
  [[nodiscard]] bool known(const Vector3d& point_world) const;

  /// How far a ray goes until it enters a cell that is not known, m; `range` if it does not
  /// before. `direction_world` is a unit vector.
  [[nodiscard]] double known_along(const Vector3d& origin_world,
                                   const Vector3d& direction_world,
                                   double range) const;

  /// True if a beam reached a surface at `range` through what is known. The last cell's width
  /// does not count: a surface lies in cells that rays ended in, and beside others.
  [[nodiscard]] bool is_seen_through(const Vector3d& origin_world,
                                     const Vector3d& direction_world,
                                     double range) const {
    const double clear = range - grid_.cell;
    return clear <= 0.0 || known_along(origin_world, direction_world, clear) >= clear;
  }

  [[nodiscard]] const CellGrid& grid() const { return grid_; }  ///< Where its cells lie.
  /// Share of the grid's cells that are known, 0 to 1.
  [[nodiscard]] double known_share() const;

  /// The section of a map that was moved: p_new = T_new_old * p_old.
  [[nodiscard]] std::vector<std::byte> moved(const Pose& T_new_old) const;
  /// The section without the cells of these points: surfels that an edit took away.
  [[nodiscard]] std::vector<std::byte> without(std::span<const Vector3d> points_world) const;

 private:
  KnownSpace(const CellGrid& grid, std::span<const std::byte> section)
      : grid_(grid), section_(section) {}

  [[nodiscard]] bool is_set(std::uint64_t index) const;

  CellGrid grid_;
  std::span<const std::byte> section_;
};

/// Collects the cells that rays cross, from several threads: the result does not depend on them.
class KnownSpaceBuilder {
 public:
  /// A grid over `box_world` (not empty) with cells of 0.2 m, or 2 `resolution`, or as wide as it
  /// takes for the section to have at most a byte for each of `surfels` (1024 at least).
  KnownSpaceBuilder(const Aabb& box_world, double resolution, std::uint64_t surfels);

  /// A ray was free up to `range`, m: marks the cells on its way, the one of its end included.
  void cross(const Vector3d& origin_world, const Vector3d& direction_world, double range);
  /// Marks the cells whose centres `is_known` accepts.
  template <class IsKnown>
  void add(const IsKnown& is_known) {
    for (std::uint64_t i = 0; i < grid_.count(); ++i) {
      if (is_known(grid_.center_of(i))) set(i);
    }
  }

  /// For `MapDescription::extra`.
  [[nodiscard]] std::vector<std::byte> section() const;

 private:
  void set(std::uint64_t index);

  CellGrid grid_;
  std::unique_ptr<std::atomic<std::uint64_t>[]> bits_;
};

}  // namespace pointflight
