#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <span>
#include <vector>

#include "pointflight/geometry/internal/morton.hpp"
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

  /// Adds the points of another cell at the same position.
  void add(const VoxelCell& other);
};

/// Voxels lie less than this far from (0, 0, 0) along each axis.
inline constexpr std::int32_t kMaxVoxel = 1 << 20;

/// Place of a voxel along the Morton curve.
inline std::uint64_t voxel_key(const std::array<std::int32_t, 3>& voxel) {
  return morton_encode(static_cast<std::uint32_t>(voxel[0] + kMaxVoxel),
                       static_cast<std::uint32_t>(voxel[1] + kMaxVoxel),
                       static_cast<std::uint32_t>(voxel[2] + kMaxVoxel));
}

/// How cells lie in the world: voxel (0, 0, 0) has its low corner at `base_world`.
struct VoxelFrame {
  Vector3d base_world = Vector3d::Zero();
  double resolution = 0.0;  ///< r, m.

  /// A point in its cell, relative to the cell's centre, metres.
  struct Place {
    std::array<std::int32_t, 3> voxel;
    Vector3d in_cell;
  };
  /// Nothing for points kMaxVoxel cells or more from the base.
  [[nodiscard]] std::optional<Place> place_of(const Vector3d& point_world) const;

  /// World position of a cell's mean point.
  [[nodiscard]] Vector3d centroid_world(const VoxelCell& cell) const;
};

/// One point on its way into its cell.
struct CellPoint {
  std::array<std::int32_t, 3> voxel;
  std::array<float, 3> in_cell;  ///< From the cell's centre, m.
  float intensity;
};

/// Sparse grid of cells, found by voxel; memory grows with occupied cells, not points.
class VoxelGrid {
 public:
  explicit VoxelGrid(const VoxelFrame& frame);

  /// Adds points to their cells, in order.
  void add(std::span<const CellPoint> points);

  /// Adds a cell's points to those that are there.
  void add(const VoxelCell& cell);

  [[nodiscard]] const std::vector<VoxelCell>& cells() const { return cells_; }
  [[nodiscard]] const VoxelFrame& frame() const { return frame_; }
  [[nodiscard]] double resolution() const { return frame_.resolution; }

  /// Indices of the cells in the order of their keys.
  [[nodiscard]] std::vector<std::uint32_t> morton_order() const;

  /// Calls `visit(index in cells())` for the cells up to `reach` voxels from one along each axis.
  /// For a wide reach; see NeighbourWindow for a small one.
  template <class Visit>
  void for_each_within(const std::array<std::int32_t, 3>& voxel,
                       std::int32_t reach,
                       const Visit& visit) const {
    const auto brick = [](std::int32_t v) { return v >> 2; };
    for (std::int32_t x = brick(voxel[0] - reach); x <= brick(voxel[0] + reach); ++x) {
      for (std::int32_t y = brick(voxel[1] - reach); y <= brick(voxel[1] + reach); ++y) {
        for (std::int32_t z = brick(voxel[2] - reach); z <= brick(voxel[2] + reach); ++z) {
          const std::uint32_t at = find_brick(brick_key(4 * x, 4 * y, 4 * z));
          if (at == kNone) continue;
          for (std::uint64_t left = bricks_[at].occupied; left != 0; left &= left - 1) {
            const std::uint32_t cell =
                bricks_[at].cells[static_cast<std::size_t>(std::countr_zero(left))];
            bool within = true;
            for (std::size_t axis = 0; axis < 3; ++axis) {
              within = within && std::abs(cells_[cell].voxel[axis] - voxel[axis]) <= reach;
            }
            if (within) visit(cell);
          }
        }
      }
    }
  }

  /// Bytes that it takes.
  [[nodiscard]] std::size_t memory() const;

  static constexpr std::uint32_t kNone = 0xffffffffu;

 private:
  friend class NeighbourWindow;

  /// 4 x 4 x 4 voxels: neighbours lie together, so that few look-ups in the table are needed.
  struct Brick {
    std::uint64_t key = 0;
    std::uint64_t occupied = 0;             ///< A bit for each of `cells`.
    std::array<std::uint32_t, 64> cells{};  ///< Indices into cells_, or kNone; in Morton order.
  };
  static std::uint64_t brick_key(std::int32_t x, std::int32_t y, std::int32_t z);
  static std::size_t place_in_brick(std::int32_t x, std::int32_t y, std::int32_t z) {
    // the low two bits of each
    constexpr std::array<std::uint8_t, 4> kSpread = {0, 1, 8, 9};
    const auto part = [&](std::int32_t v) {
      return std::size_t{kSpread[static_cast<std::size_t>(v & 3)]};
    };
    return part(x) | part(y) << 1 | part(z) << 2;
  }
  /// The brick's index in bricks_, made if it is new.
  std::uint32_t brick_at(std::uint64_t key);
  /// The cell's index in cells_, made if it is new.
  std::uint32_t cell_at(const std::array<std::int32_t, 3>& voxel);
  /// Index of a brick in bricks_, or kNone.
  [[nodiscard]] std::uint32_t find_brick(std::uint64_t key) const;
  [[nodiscard]] std::size_t slot_of(std::uint64_t key) const;
  void resize_table(std::size_t slots);

  VoxelFrame frame_;
  std::vector<VoxelCell> cells_;
  std::vector<Brick> bricks_;
  std::vector<std::uint32_t> slots_;  ///< Open addressing: indices into bricks_, or kNone.
  std::uint32_t last_brick_ = kNone;  ///< The one used last: neighbours follow each other.
};

/// Looks around cells of a grid that does not change. One per thread; fast if consecutive cells
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
    const Span x{v[0] & 3, reach};
    const Span y{v[1] & 3, reach};
    const Span z{v[2] & 3, reach};
    for (std::int32_t bx = x.first_brick(); bx <= x.last_brick(); ++bx) {
      for (std::int32_t by = y.first_brick(); by <= y.last_brick(); ++by) {
        for (std::int32_t bz = z.first_brick(); bz <= z.last_brick(); ++bz) {
          const std::int32_t place = bx * 9 + by * 3 + bz + 13;
          const VoxelGrid::Brick* brick = around_[static_cast<std::size_t>(place)];
          if (brick == nullptr) continue;
          std::uint64_t left = brick->occupied & kPlaces[0][x.within(bx)] &
                               kPlaces[1][y.within(by)] & kPlaces[2][z.within(bz)];
          for (; left != 0; left &= left - 1) {
            const VoxelCell& other =
                grid_.cells_[brick->cells[static_cast<std::size_t>(std::countr_zero(left))]];
            visit(other, other.voxel[0] - v[0], other.voxel[1] - v[1], other.voxel[2] - v[2]);
          }
        }
      }
    }
  }

 private:
  /// The cells up to `reach` from one that lies at `at` (0 to 3) in its brick, along one axis.
  struct Span {
    std::int32_t at;
    std::int32_t reach;
    [[nodiscard]] std::int32_t first_brick() const { return (at - reach) >> 2; }
    [[nodiscard]] std::int32_t last_brick() const { return (at + reach) >> 2; }
    /// Those in a brick, as four bits.
    [[nodiscard]] std::size_t within(std::int32_t brick) const {
      const std::int32_t low = std::max(0, at - reach - 4 * brick);
      const std::int32_t high = std::min(3, at + reach - 4 * brick);
      return (0xfu >> (3 - high)) & (0xfu << low);
    }
  };

  using PlaceMasks = std::array<std::array<std::uint64_t, 16>, 3>;
  /// Places of a brick whose coordinate along an axis is among four bits.
  static constexpr PlaceMasks kPlaces = [] {
    PlaceMasks masks{};
    for (std::size_t place = 0; place < 64; ++place) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t at = (place >> axis & 1) | (place >> (axis + 3) & 1) << 1;
        for (std::size_t bits = 0; bits < 16; ++bits) {
          if (bits >> at & 1) masks[axis][bits] |= std::uint64_t{1} << place;
        }
      }
    }
    return masks;
  }();

  void move_to(const VoxelCell& cell);

  const VoxelGrid& grid_;
  std::uint64_t key_ = ~0ull;                         ///< Of the brick in the middle.
  std::array<const VoxelGrid::Brick*, 27> around_{};  ///< Null if empty.
};

}  // namespace pointflight
