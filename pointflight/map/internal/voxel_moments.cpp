#include "pointflight/map/internal/voxel_moments.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/floor.hpp"
#include "pointflight/core/hash.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kSlotsMin = 1 << 12;

}  // namespace

Moments Moments::about(const Vector3d& shift) const {
  Moments moved;
  moved.n = n;
  moved.sum = sum - n * shift;
  moved.products =
      products - sum * shift.transpose() - shift * sum.transpose() + n * shift * shift.transpose();
  return moved;
}

Moments VoxelCell::moments() const {
  Moments m;
  m.n = n;
  m.sum = Eigen::Map<const Vector3f>(sum.data()).cast<double>();
  m.products << products[0], products[1], products[2],  //
      products[1], products[3], products[4],            //
      products[2], products[4], products[5];
  return m;
}

void VoxelCell::add(const VoxelCell& other) {
  n += other.n;
  for (std::size_t k = 0; k < 3; ++k) sum[k] += other.sum[k];
  for (std::size_t k = 0; k < 6; ++k) products[k] += other.products[k];
  intensity_sum += other.intensity_sum;
}

std::optional<VoxelFrame::Place> VoxelFrame::place_of(const Vector3d& point_world) const {
  const Vector3d cells = (point_world - base_world) * (1.0 / resolution);
  if (!(cells.cwiseAbs().maxCoeff() < kMaxVoxel)) return std::nullopt;
  Place place{};
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t low = floor_to_integer(cells[axis]);
    place.voxel[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(low);
    place.in_cell[axis] = (cells[axis] - static_cast<double>(low) - 0.5) * resolution;
  }
  return place;
}

Vector3d VoxelFrame::centroid_world(const VoxelCell& cell) const {
  const Vector3d center(cell.voxel[0] + 0.5, cell.voxel[1] + 0.5, cell.voxel[2] + 0.5);
  return base_world + resolution * center +
         Eigen::Map<const Vector3f>(cell.sum.data()).cast<double>() / cell.n;
}

VoxelGrid::VoxelGrid(const VoxelFrame& frame) : frame_(frame), slots_(kSlotsMin, kNone) {}

std::uint64_t VoxelGrid::brick_key(std::int32_t x, std::int32_t y, std::int32_t z) {
  // 19 bits and a sign each
  constexpr std::uint64_t kMask = (1u << 21) - 1;
  const auto part = [](std::int32_t v) { return static_cast<std::uint64_t>(v >> 2) & kMask; };
  return part(x) | part(y) << 21 | part(z) << 42;
}

std::size_t VoxelGrid::slot_of(std::uint64_t key) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = scatter64(key) & mask;
  while (slots_[slot] != kNone && bricks_[slots_[slot]].key != key) slot = (slot + 1) & mask;
  return slot;
}

std::uint32_t VoxelGrid::find_brick(std::uint64_t key) const {
  return slots_[slot_of(key)];
}

void VoxelGrid::resize_table(std::size_t slots) {
  slots_.assign(slots, kNone);
  for (std::uint32_t i = 0; i < bricks_.size(); ++i) slots_[slot_of(bricks_[i].key)] = i;
}

std::uint32_t VoxelGrid::brick_at(std::uint64_t key) {
  const std::uint32_t found = slots_[slot_of(key)];
  if (found != kNone) return found;
  if (2 * (bricks_.size() + 1) > slots_.size()) resize_table(2 * slots_.size());
  const auto index = static_cast<std::uint32_t>(bricks_.size());
  slots_[slot_of(key)] = index;
  Brick& brick = bricks_.emplace_back();
  brick.key = key;
  brick.cells.fill(kNone);
  return index;
}

std::uint32_t VoxelGrid::cell_at(const std::array<std::int32_t, 3>& voxel) {
  const std::uint64_t key = brick_key(voxel[0], voxel[1], voxel[2]);
  if (last_brick_ == kNone || bricks_[last_brick_].key != key) last_brick_ = brick_at(key);
  Brick& brick = bricks_[last_brick_];
  const std::size_t place = place_in_brick(voxel[0], voxel[1], voxel[2]);
  std::uint32_t& cell = brick.cells[place];
  if (cell == kNone) {
    brick.occupied |= std::uint64_t{1} << place;
    cell = static_cast<std::uint32_t>(cells_.size());
    cells_.emplace_back().voxel = voxel;
  }
  return cell;
}

void VoxelGrid::add(std::span<const CellPoint> points) {
  // points of a scan scatter: what one needs is fetched while others are looked up, or each would
  // wait for memory four times (slot, brick, entry, cell)
  constexpr std::size_t kGroup = 32;
  std::array<std::uint32_t, kGroup> at{};
  for (std::size_t first = 0; first < points.size(); first += kGroup) {
    const auto group = points.subspan(first, std::min(kGroup, points.size() - first));
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t i = 0; i < group.size(); ++i) {
      const auto& v = group[i].voxel;
      __builtin_prefetch(&slots_[scatter64(brick_key(v[0], v[1], v[2])) & mask]);
    }
    for (std::size_t i = 0; i < group.size(); ++i) {
      const auto& v = group[i].voxel;
      at[i] = slots_[scatter64(brick_key(v[0], v[1], v[2])) & mask];
      if (at[i] == kNone) continue;
      __builtin_prefetch(&bricks_[at[i]].key);
      __builtin_prefetch(&bricks_[at[i]].cells[place_in_brick(v[0], v[1], v[2])]);
    }
    for (std::size_t i = 0; i < group.size(); ++i) {
      if (at[i] == kNone) continue;
      const auto& v = group[i].voxel;
      const std::uint32_t cell = bricks_[at[i]].cells[place_in_brick(v[0], v[1], v[2])];
      if (cell != kNone) __builtin_prefetch(&cells_[cell]);
    }
    for (const CellPoint& p : group) {
      VoxelCell& cell = cells_[cell_at(p.voxel)];
      const auto& q = p.in_cell;
      ++cell.n;
      for (std::size_t axis = 0; axis < 3; ++axis) cell.sum[axis] += q[axis];
      cell.products[0] += q[0] * q[0];
      cell.products[1] += q[0] * q[1];
      cell.products[2] += q[0] * q[2];
      cell.products[3] += q[1] * q[1];
      cell.products[4] += q[1] * q[2];
      cell.products[5] += q[2] * q[2];
      cell.intensity_sum += p.intensity;
    }
  }
}

void VoxelGrid::add(const VoxelCell& cell) {
  cells_[cell_at(cell.voxel)].add(cell);
}

std::vector<std::uint32_t> VoxelGrid::morton_order() const {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> bricks(bricks_.size());
  for (std::uint32_t i = 0; i < bricks.size(); ++i) {
    // any cell of a brick tells where the brick lies
    const auto& entries = bricks_[i].cells;
    const auto any = std::find_if(
        entries.begin(), entries.end(), [](std::uint32_t cell) { return cell != kNone; });
    bricks[i] = {voxel_key(cells_[*any].voxel) >> 6, i};
  }
  std::sort(bricks.begin(), bricks.end());
  std::vector<std::uint32_t> order;
  order.reserve(cells_.size());
  for (const auto& brick : bricks) {
    for (const std::uint32_t cell : bricks_[brick.second].cells) {
      if (cell != kNone) order.push_back(cell);
    }
  }
  return order;
}

std::size_t VoxelGrid::memory() const {
  return cells_.capacity() * sizeof(VoxelCell) + bricks_.capacity() * sizeof(Brick) +
         slots_.capacity() * sizeof(std::uint32_t);
}

void NeighbourWindow::move_to(const VoxelCell& cell) {
  const auto& v = cell.voxel;
  const std::uint64_t key = VoxelGrid::brick_key(v[0], v[1], v[2]);
  if (key == key_) return;
  key_ = key;
  std::size_t i = 0;
  for (const std::int32_t dx : {-4, 0, 4}) {
    for (const std::int32_t dy : {-4, 0, 4}) {
      for (const std::int32_t dz : {-4, 0, 4}) {
        const std::uint32_t at =
            grid_.find_brick(VoxelGrid::brick_key(v[0] + dx, v[1] + dy, v[2] + dz));
        around_[i++] = at == VoxelGrid::kNone ? nullptr : &grid_.bricks_[at];
      }
    }
  }
}

Moments NeighbourWindow::moments(const VoxelCell& cell, std::int32_t reach) {
  double n = 0.0;
  std::array<double, 3> sum{};
  std::array<double, 6> products{};
  const double r = grid_.resolution();
  for_each(cell, reach, [&](const VoxelCell& other, int dx, int dy, int dz) {
    // sum of (q + d) and (q + d)(q + d)^T over the points q of the other cell
    const double count = other.n;
    const std::array<double, 3> d = {r * dx, r * dy, r * dz};
    const std::array<double, 3> s = {static_cast<double>(other.sum[0]),
                                     static_cast<double>(other.sum[1]),
                                     static_cast<double>(other.sum[2])};
    const std::array<double, 3> t = {s[0] + count * d[0], s[1] + count * d[1], s[2] + count * d[2]};
    n += count;
    for (std::size_t k = 0; k < 3; ++k) sum[k] += t[k];
    const auto product = [&](std::size_t k, std::size_t a, std::size_t b) {
      products[k] += static_cast<double>(other.products[k]) + s[a] * d[b] + t[b] * d[a];
    };
    product(0, 0, 0);
    product(1, 0, 1);
    product(2, 0, 2);
    product(3, 1, 1);
    product(4, 1, 2);
    product(5, 2, 2);
  });
  Moments all;
  all.n = n;
  all.sum = {sum[0], sum[1], sum[2]};
  all.products << products[0], products[1], products[2],  //
      products[1], products[3], products[4],              //
      products[2], products[4], products[5];
  return all;
}

}  // namespace pointflight
