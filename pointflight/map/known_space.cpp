#include "pointflight/map/known_space.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/floor.hpp"

namespace pointflight {
namespace {

constexpr double kFinest = 0.2;                  // m: what beams of a survey leave no gaps in
constexpr std::uint64_t kLeastBudget = 1024;     // bytes
constexpr std::uint32_t kMostCells = 1u << 20;   // along an axis
constexpr std::uint64_t kCellsMax = 1ull << 40;  // so that no product overflows

/// First bytes of the section.
struct KnownHeader {
  double cell;             ///< m
  double translation[3];   ///< T_world_grid, m.
  double quaternion[4];    ///< x, y, z, w
  std::uint32_t size[3];   ///< Cells.
  std::uint32_t reserved;  ///< Zero.
};
static_assert(sizeof(KnownHeader) == 80);

std::uint64_t bytes_of(std::uint64_t cells) {
  return sizeof(KnownHeader) + (cells + 63) / 64 * 8;
}

KnownHeader header_of(const CellGrid& grid) {
  KnownHeader header{};
  header.cell = grid.cell;
  for (int axis = 0; axis < 3; ++axis) {
    header.translation[axis] = grid.T_world_grid.translation[axis];
    header.size[axis] = grid.size[static_cast<std::size_t>(axis)];
  }
  for (int i = 0; i < 4; ++i) header.quaternion[i] = grid.T_world_grid.rotation.coeffs()[i];
  return header;
}

/// Calls `visit(index, t)` for the cells that a ray crosses within [0, range], t where it enters
/// them, until that says false (Amanatides and Woo, "A Fast Voxel Traversal Algorithm for Ray
/// Tracing", 1987). Returns where the ray left the grid, or range.
template <class Visit>
double walk(const CellGrid& grid,
            const Vector3d& origin_world,
            const Vector3d& direction_world,
            double range,
            const Visit& visit) {
  const Quaterniond back = grid.T_world_grid.rotation.conjugate();
  const Vector3d o = (back * (origin_world - grid.T_world_grid.translation)) / grid.cell;
  const Vector3d d = (back * direction_world) / grid.cell;  // cells per metre
  double enters = 0.0;
  double leaves = range;
  for (int axis = 0; axis < 3; ++axis) {
    const double end = grid.size[static_cast<std::size_t>(axis)];
    if (d[axis] == 0.0) {
      if (!(o[axis] >= 0.0 && o[axis] < end)) return 0.0;
      continue;
    }
    const double to_low = (0.0 - o[axis]) / d[axis];
    const double to_high = (end - o[axis]) / d[axis];
    enters = std::max(enters, std::min(to_low, to_high));
    leaves = std::min(leaves, std::max(to_low, to_high));
  }
  if (!(enters <= leaves)) return 0.0;
  std::array<std::int64_t, 3> at{};
  std::array<std::int64_t, 3> step{};
  Vector3d next = Vector3d::Constant(std::numeric_limits<double>::infinity());
  Vector3d each = next;
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    at[k] = std::clamp<std::int64_t>(
        floor_to_integer(o[axis] + enters * d[axis]), 0, std::int64_t{grid.size[k]} - 1);
    if (d[axis] == 0.0) continue;
    step[k] = d[axis] > 0.0 ? 1 : -1;
    each[axis] = std::abs(1.0 / d[axis]);
    const auto face = static_cast<double>(at[k] + (d[axis] > 0.0 ? 1 : 0));
    next[axis] = (face - o[axis]) / d[axis];
  }
  double t = enters;
  while (t <= leaves) {
    const auto index =
        (static_cast<std::uint64_t>(at[2]) * grid.size[1] + static_cast<std::uint64_t>(at[1])) *
            grid.size[0] +
        static_cast<std::uint64_t>(at[0]);
    if (!visit(index, t)) return t;
    int axis = next[0] < next[1] ? 0 : 1;
    if (next[2] < next[axis]) axis = 2;
    const auto k = static_cast<std::size_t>(axis);
    t = next[axis];
    at[k] += step[k];
    if (at[k] < 0 || at[k] >= std::int64_t{grid.size[k]}) break;
    next[axis] += each[axis];
  }
  return leaves;
}

CellGrid grid_over(const Aabb& box, double cell) {
  CellGrid grid;
  grid.cell = cell;
  grid.T_world_grid.translation = box.min;
  for (int axis = 0; axis < 3; ++axis) {
    const double cells = std::floor(box.size()[axis] / cell) + 1.0;
    grid.size[static_cast<std::size_t>(axis)] =
        static_cast<std::uint32_t>(std::min(cells, static_cast<double>(kMostCells)));
  }
  return grid;
}

}  // namespace

std::optional<std::uint64_t> CellGrid::index_of(const Vector3d& point_world) const {
  const Vector3d p = (T_world_grid.inverse() * point_world) / cell;
  std::array<std::uint64_t, 3> at{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    if (!(p[axis] >= 0.0 && p[axis] < static_cast<double>(size[k]))) return std::nullopt;
    at[k] = static_cast<std::uint64_t>(p[axis]);
  }
  return (at[2] * size[1] + at[1]) * size[0] + at[0];
}

Vector3d CellGrid::center_of(std::uint64_t index) const {
  const std::uint64_t row = index / size[0];
  const std::uint64_t layer = row / size[1];
  const Vector3d at(static_cast<double>(index % size[0]),
                    static_cast<double>(row % size[1]),
                    static_cast<double>(layer));
  return T_world_grid * (cell * (at + Vector3d::Constant(0.5)));
}

std::optional<KnownSpace> KnownSpace::from_section(std::span<const std::byte> section) {
  KnownHeader header{};
  if (section.size() < sizeof header) return std::nullopt;
  std::memcpy(&header, section.data(), sizeof header);
  CellGrid grid;
  grid.cell = header.cell;
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint32_t cells = header.size[axis];
    if (cells == 0 || cells > kMostCells) return std::nullopt;
    grid.size[static_cast<std::size_t>(axis)] = cells;
    grid.T_world_grid.translation[axis] = header.translation[axis];
  }
  grid.T_world_grid.rotation = Quaterniond(header.quaternion);  // x, y, z, w
  const bool is_sound = grid.cell >= 1e-6 && grid.cell <= 1e6 &&
                        grid.T_world_grid.translation.allFinite() &&
                        std::abs(grid.T_world_grid.rotation.norm() - 1.0) < 1e-6 &&
                        grid.count() <= kCellsMax && section.size() == bytes_of(grid.count());
  if (!is_sound) return std::nullopt;
  return KnownSpace(grid, section);
}

bool KnownSpace::is_set(std::uint64_t index) const {
  const auto byte = static_cast<unsigned>(section_[sizeof(KnownHeader) + index / 8]);
  return ((byte >> (index % 8)) & 1u) != 0;
}

bool KnownSpace::known(const Vector3d& point_world) const {
  const auto index = grid_.index_of(point_world);
  return index && is_set(*index);
}

double KnownSpace::known_along(const Vector3d& origin_world,
                               const Vector3d& direction_world,
                               double range) const {
  if (!grid_.index_of(origin_world) || !direction_world.allFinite()) return 0.0;
  return walk(grid_, origin_world, direction_world, range, [&](std::uint64_t index, double) {
    return is_set(index);
  });
}

double KnownSpace::known_share() const {
  std::uint64_t set = 0;
  for (const std::byte byte : section_.subspan(sizeof(KnownHeader))) {
    set += static_cast<std::uint64_t>(std::popcount(static_cast<std::uint8_t>(byte)));
  }
  return static_cast<double>(set) / static_cast<double>(grid_.count());
}

std::vector<std::byte> KnownSpace::moved(const Pose& T_new_old) const {
  std::vector<std::byte> section(section_.begin(), section_.end());
  CellGrid grid = grid_;
  grid.T_world_grid = T_new_old * grid.T_world_grid;
  grid.T_world_grid.rotation.normalize();
  const KnownHeader header = header_of(grid);
  std::memcpy(section.data(), &header, sizeof header);
  return section;
}

std::vector<std::byte> KnownSpace::without(std::span<const Vector3d> points_world) const {
  std::vector<std::byte> section(section_.begin(), section_.end());
  for (const Vector3d& point : points_world) {
    const auto index = grid_.index_of(point);
    if (!index) continue;
    section[sizeof(KnownHeader) + *index / 8] &= ~(std::byte{1} << (*index % 8));
  }
  return section;
}

KnownSpaceBuilder::KnownSpaceBuilder(const Aabb& box_world,
                                     double resolution,
                                     std::uint64_t surfels) {
  require_argument(!box_world.empty() && box_world.size().allFinite() && resolution > 0.0,
                   "KnownSpaceBuilder: a box and a resolution are wanted");
  const std::uint64_t budget = std::max(surfels, kLeastBudget);
  double cell = std::max({kFinest, 2.0 * resolution, box_world.size().maxCoeff() / 1e6});
  grid_ = grid_over(box_world, cell);
  while (bytes_of(grid_.count()) > budget) {
    cell *= 1.02;
    grid_ = grid_over(box_world, cell);
  }
  bits_.reset(new std::atomic<std::uint64_t>[(grid_.count() + 63) / 64]());
}

void KnownSpaceBuilder::set(std::uint64_t index) {
  const std::uint64_t bit = std::uint64_t{1} << (index % 64);
  std::atomic<std::uint64_t>& word = bits_[index / 64];
  // most are set already: a read that all cores share instead of a write that none do
  if ((word.load(std::memory_order_relaxed) & bit) == 0) {
    word.fetch_or(bit, std::memory_order_relaxed);
  }
}

void KnownSpaceBuilder::cross(const Vector3d& origin_world,
                              const Vector3d& direction_world,
                              double range) {
  walk(grid_, origin_world, direction_world, range, [&](std::uint64_t index, double) {
    set(index);
    return true;
  });
}

std::vector<std::byte> KnownSpaceBuilder::section() const {
  std::vector<std::byte> bytes(bytes_of(grid_.count()));
  const KnownHeader header = header_of(grid_);
  std::memcpy(bytes.data(), &header, sizeof header);
  for (std::uint64_t i = 0; i < (grid_.count() + 63) / 64; ++i) {
    const std::uint64_t word = bits_[i].load(std::memory_order_relaxed);
    std::memcpy(bytes.data() + sizeof header + 8 * i, &word, sizeof word);
  }
  return bytes;
}

}  // namespace pointflight
