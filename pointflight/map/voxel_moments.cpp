#include "pointflight/map/voxel_moments.hpp"

#include <cmath>

namespace pointflight {
namespace {

constexpr double kMaxCells = 1 << 20;

std::uint64_t hash_voxel(const std::array<std::int32_t, 3>& voxel) {
  // large odd constants, then a finaliser (Murmur3's) so that neighbours scatter
  std::uint64_t h = static_cast<std::uint32_t>(voxel[0]) * 0x9e3779b97f4a7c15ull;
  h ^= static_cast<std::uint32_t>(voxel[1]) * 0xc2b2ae3d27d4eb4full;
  h ^= static_cast<std::uint32_t>(voxel[2]) * 0x165667b19e3779f9ull;
  h ^= h >> 33;
  h *= 0xff51afd7ed558ccdull;
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
    : base_(base_world), resolution_(resolution), slots_(1 << 16, kNone) {}

std::size_t VoxelGrid::slot_of(const std::array<std::int32_t, 3>& voxel) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = hash_voxel(voxel) & mask;
  while (slots_[slot] != kNone && cells_[slots_[slot]].voxel != voxel) slot = (slot + 1) & mask;
  return slot;
}

void VoxelGrid::grow(std::size_t slots) {
  slots_.assign(slots, kNone);
  for (std::uint32_t i = 0; i < cells_.size(); ++i) slots_[slot_of(cells_[i].voxel)] = i;
}

VoxelCell* VoxelGrid::cell_at(const Vector3d& cells) {
  if (!(cells.cwiseAbs().maxCoeff() < kMaxCells)) return nullptr;
  const Vector3d low = cells.array().floor();
  const std::array<std::int32_t, 3> voxel = {static_cast<std::int32_t>(low.x()),
                                             static_cast<std::int32_t>(low.y()),
                                             static_cast<std::int32_t>(low.z())};
  std::size_t slot = slot_of(voxel);
  if (slots_[slot] == kNone) {
    if (2 * (cells_.size() + 1) > slots_.size()) {
      grow(2 * slots_.size());
      slot = slot_of(voxel);
    }
    slots_[slot] = static_cast<std::uint32_t>(cells_.size());
    cells_.emplace_back().voxel = voxel;
  }
  return &cells_[slots_[slot]];
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

Moments VoxelGrid::neighbourhood(const VoxelCell& cell, std::int32_t reach) const {
  Moments all;
  for (std::int32_t dx = -reach; dx <= reach; ++dx) {
    for (std::int32_t dy = -reach; dy <= reach; ++dy) {
      for (std::int32_t dz = -reach; dz <= reach; ++dz) {
        const std::uint32_t at = find({cell.voxel[0] + dx, cell.voxel[1] + dy, cell.voxel[2] + dz});
        if (at == kNone) continue;
        all.add(cells_[at].moments().about(resolution_ * -Vector3d(dx, dy, dz)));
      }
    }
  }
  return all;
}

std::uint32_t VoxelGrid::find(const std::array<std::int32_t, 3>& voxel) const {
  return slots_[slot_of(voxel)];
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
  grow(slots_.size());
}

}  // namespace pointflight
