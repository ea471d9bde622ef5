#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Count, sums and products of the points in a cell, relative to a reference point: everything that
/// a plane fit needs, and moments of neighbours add.
struct Moments {
  double n = 0.0;
  Vector3d sum = Vector3d::Zero();
  Matrix3d products = Matrix3d::Zero();  ///< Sum of p p^T.

  void add(const Moments& other) {
    n += other.n;
    sum += other.sum;
    products += other.products;
  }
  [[nodiscard]] Vector3d mean() const { return sum / n; }
  [[nodiscard]] Matrix3d covariance() const {
    const Vector3d m = mean();
    return products / n - m * m.transpose();
  }
  /// The same points seen from a reference point that lies at `shift` from the present one.
  [[nodiscard]] Moments about(const Vector3d& shift) const;
};

/// One occupied cell, 52 bytes. Sums are relative to the cell's centre, metres.
struct VoxelCell {
  std::array<std::int32_t, 3> voxel{};  ///< Coordinates in the grid.
  std::uint32_t n = 0;
  std::array<float, 3> sum{};
  std::array<float, 6> products{};  ///< xx, xy, xz, yy, yz, zz.
  float intensity_sum = 0.0f;

  [[nodiscard]] Moments moments() const;
};

/// Sparse grid that accumulates points in one pass; memory grows with occupied cells, not points.
class VoxelGrid {
 public:
  /// Cell (0, 0, 0) has its low corner at `base_world`; `resolution` in metres.
  VoxelGrid(const Vector3d& base_world, double resolution);

  /// False if the point lies more than 2^20 cells from the base.
  bool add(const Vector3d& point_world, float intensity);

  /// Adds `n` points by their mean and covariance; false where `add` would be.
  bool add(const Vector3d& mean_world,
           const Matrix3d& covariance,
           std::uint32_t n,
           float intensity_sum);

  [[nodiscard]] const std::vector<VoxelCell>& cells() const { return cells_; }
  [[nodiscard]] const Vector3d& base_world() const { return base_; }
  [[nodiscard]] double resolution() const { return resolution_; }

  /// Index of a cell in `cells()`, or kNone.
  [[nodiscard]] std::uint32_t find(const std::array<std::int32_t, 3>& voxel) const;
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// World position of the cell's mean point.
  [[nodiscard]] Vector3d centroid_world(const VoxelCell& cell) const;

  /// Keeps the cells for which `keep[index]` is true, in the given order of indices.
  void reorder(const std::vector<std::uint32_t>& indices);

 private:
  /// The cell of a place given in cells from the base, made where it is new; null out of reach.
  VoxelCell* cell_at(const Vector3d& cells);
  friend class NeighbourWindow;

  /// 4 x 4 x 4 voxels: neighbours lie together, so that few look-ups in the table are needed.
  struct Brick {
    std::uint64_t key = 0;
    std::array<std::uint32_t, 64>
        cells{};  ///< Indices into cells_, or kNone; x, y, z fastest last.
  };
  static std::uint64_t brick_key(std::int32_t x, std::int32_t y, std::int32_t z);
  static std::size_t place_in_brick(std::int32_t x, std::int32_t y, std::int32_t z) {
    return static_cast<std::size_t>((x & 3) << 4 | (y & 3) << 2 | (z & 3));
  }
  /// Index of a brick in bricks_, or kNone.
  [[nodiscard]] std::uint32_t find_brick(std::uint64_t key) const;
  [[nodiscard]] std::size_t slot_of(std::uint64_t key) const;
  std::uint32_t add_brick(std::uint64_t key);
  void resize_table(std::size_t slots);

  Vector3d base_;
  double resolution_;
  std::vector<VoxelCell> cells_;
  std::vector<Brick> bricks_;
  std::vector<std::uint32_t> slots_;  ///< Open addressing: indices into bricks_, or kNone.
  std::uint32_t last_brick_ = kNone;  ///< The one added to last: scans stay in one for a while.
};

/// Looks around cells of a grid that does not change. One a thread; fast where consecutive cells
/// lie near each other.
class NeighbourWindow {
 public:
  static constexpr std::int32_t kReachMax = 4;

  explicit NeighbourWindow(const VoxelGrid& grid) : grid_(grid) {}

  /// Moments of the (2 reach + 1)^3 cells around one, relative to its centre; `reach` up to
  /// kReachMax.
  [[nodiscard]] Moments moments(const VoxelCell& cell, std::int32_t reach);

  /// Calls `visit(neighbour, dx, dy, dz)` for the occupied cells around one, itself included, with
  /// their distances in voxels.
  template <class Visit>
  void for_each(const VoxelCell& cell, std::int32_t reach, const Visit& visit) {
    move_to(cell);
    const auto& v = cell.voxel;
    for (std::int32_t dx = -reach; dx <= reach; ++dx) {
      for (std::int32_t dy = -reach; dy <= reach; ++dy) {
        for (std::int32_t dz = -reach; dz <= reach; ++dz) {
          const std::int32_t x = (v[0] & 3) + dx;
          const std::int32_t y = (v[1] & 3) + dy;
          const std::int32_t z = (v[2] & 3) + dz;
          const std::int32_t place = (x >> 2) * 9 + (y >> 2) * 3 + (z >> 2) + 13;
          const VoxelGrid::Brick* brick = around_[static_cast<std::size_t>(place)];
          if (brick == nullptr) continue;
          const std::uint32_t at = brick->cells[VoxelGrid::place_in_brick(x, y, z)];
          if (at != VoxelGrid::kNone) visit(grid_.cells_[at], dx, dy, dz);
        }
      }
    }
  }

 private:
  void move_to(const VoxelCell& cell);

  const VoxelGrid& grid_;
  std::uint64_t key_ = ~0ull;                         ///< Of the brick in the middle.
  std::array<const VoxelGrid::Brick*, 27> around_{};  ///< Null where empty.
};

}  // namespace pointflight
