#include "pointflight/map/voxel_moments.hpp"

#include <cmath>

namespace pointflight {
namespace {

constexpr double kMaxCells = 1 << 20;

constexpr std::size_t kSlotsMin = 1 << 12;

/// Murmur3's finaliser: neighbours scatter.
std::uint64_t hash_key(std::uint64_t h) {
  h ^= h >> 33;
  h *= 0xff51afd7ed558ccdull;
  h ^= h >> 33;
  h *= 0xc4ceb9fe1a85ec53ull;
  h ^= h >> 33;
  return h;
}

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

VoxelGrid::VoxelGrid(const Vector3d& base_world, double resolution)
    : base_(base_world), resolution_(resolution), slots_(kSlotsMin, kNone) {}

std::uint64_t VoxelGrid::brick_key(std::int32_t x, std::int32_t y, std::int32_t z) {
  // 19 bits and a sign each
  constexpr std::uint64_t kMask = (1u << 21) - 1;
  const auto part = [](std::int32_t v) { return static_cast<std::uint64_t>(v >> 2) & kMask; };
  return part(x) | part(y) << 21 | part(z) << 42;
}

std::size_t VoxelGrid::slot_of(std::uint64_t key) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = hash_key(key) & mask;
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

std::uint32_t VoxelGrid::add_brick(std::uint64_t key) {
  if (2 * (bricks_.size() + 1) > slots_.size()) resize_table(2 * slots_.size());
  const auto index = static_cast<std::uint32_t>(bricks_.size());
  slots_[slot_of(key)] = index;
  Brick& brick = bricks_.emplace_back();
  brick.key = key;
  brick.cells.fill(kNone);
  return index;
}

VoxelCell* VoxelGrid::cell_at(const Vector3d& cells) {
  if (!(cells.cwiseAbs().maxCoeff() < kMaxCells)) return nullptr;
  const Vector3d low = cells.array().floor();
  const std::array<std::int32_t, 3> voxel = {static_cast<std::int32_t>(low.x()),
                                             static_cast<std::int32_t>(low.y()),
                                             static_cast<std::int32_t>(low.z())};
  const std::uint64_t key = brick_key(voxel[0], voxel[1], voxel[2]);
  if (last_brick_ == kNone || bricks_[last_brick_].key != key) {
    last_brick_ = find_brick(key);
    if (last_brick_ == kNone) last_brick_ = add_brick(key);
  }
  std::uint32_t& cell = bricks_[last_brick_].cells[place_in_brick(voxel[0], voxel[1], voxel[2])];
  if (cell == kNone) {
    cell = static_cast<std::uint32_t>(cells_.size());
    cells_.emplace_back().voxel = voxel;
  }
  return &cells_[cell];
}

bool VoxelGrid::add(const Vector3d& point_world, float intensity) {
  const Vector3d cells = (point_world - base_) / resolution_;
  VoxelCell* cell = cell_at(cells);
  if (cell == nullptr) return false;
  const Vector3d low = cells.array().floor();
  const Vector3f q =
      ((cells - low).array() - 0.5).matrix().cast<float>() * static_cast<float>(resolution_);
  ++cell->n;
  for (std::size_t axis = 0; axis < 3; ++axis) cell->sum[axis] += q[static_cast<int>(axis)];
  cell->products[0] += q.x() * q.x();
  cell->products[1] += q.x() * q.y();
  cell->products[2] += q.x() * q.z();
  cell->products[3] += q.y() * q.y();
  cell->products[4] += q.y() * q.z();
  cell->products[5] += q.z() * q.z();
  cell->intensity_sum += intensity;
  return true;
}

bool VoxelGrid::add(const Vector3d& mean_world,
                    const Matrix3d& covariance,
                    std::uint32_t n,
                    float intensity_sum) {
  const Vector3d cells = (mean_world - base_) / resolution_;
  VoxelCell* cell = cell_at(cells);
  if (cell == nullptr) return false;
  const Vector3d q = (cells.array() - cells.array().floor() - 0.5).matrix() * resolution_;
  const Matrix3d products = n * (covariance + q * q.transpose());
  cell->n += n;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    cell->sum[axis] += static_cast<float>(n * q[static_cast<int>(axis)]);
  }
  std::size_t k = 0;
  for (int row = 0; row < 3; ++row) {
    for (int column = row; column < 3; ++column) {
      cell->products[k++] += static_cast<float>(products(row, column));
    }
  }
  cell->intensity_sum += intensity_sum;
  return true;
}

std::uint32_t VoxelGrid::find(const std::array<std::int32_t, 3>& voxel) const {
  const std::uint32_t brick = find_brick(brick_key(voxel[0], voxel[1], voxel[2]));
  return brick == kNone ? kNone
                        : bricks_[brick].cells[place_in_brick(voxel[0], voxel[1], voxel[2])];
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

Vector3d VoxelGrid::centroid_world(const VoxelCell& cell) const {
  const Vector3d center(cell.voxel[0] + 0.5, cell.voxel[1] + 0.5, cell.voxel[2] + 0.5);
  return base_ + resolution_ * center +
         Eigen::Map<const Vector3f>(cell.sum.data()).cast<double>() / cell.n;
}

void VoxelGrid::reorder(const std::vector<std::uint32_t>& indices) {
  std::vector<VoxelCell> kept;
  kept.reserve(indices.size());
  for (const std::uint32_t i : indices) kept.push_back(cells_[i]);
  cells_ = std::move(kept);
  bricks_.clear();
  slots_.assign(kSlotsMin, kNone);
  last_brick_ = kNone;
  for (std::uint32_t i = 0; i < cells_.size(); ++i) {
    const auto& v = cells_[i].voxel;
    const std::uint64_t key = brick_key(v[0], v[1], v[2]);
    std::uint32_t brick = find_brick(key);
    if (brick == kNone) brick = add_brick(key);
    bricks_[brick].cells[place_in_brick(v[0], v[1], v[2])] = i;
  }
}

}  // namespace pointflight
