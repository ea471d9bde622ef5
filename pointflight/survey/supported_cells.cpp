#include "pointflight/survey/supported_cells.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "pointflight/core/floor.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/internal/grid_cells.hpp"
#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {
namespace {

constexpr std::int64_t kAlong = 4;  // cells of a block, along each axis

/// Of whole numbers of blocks; NaN is not.
bool is_in_reach(const Vector3d& p) {
  return p.cwiseAbs().maxCoeff() < 1e9 && p.allFinite();
}

std::int64_t block_along(std::int64_t cell) {
  return cell >> 2;  // rounds down
}

GridCell block_of(const GridCell& cell) {
  return {block_along(cell[0]), block_along(cell[1]), block_along(cell[2])};
}

std::uint64_t bit_of(const GridCell& cell) {
  const auto within = [](std::int64_t c) { return static_cast<unsigned>(c & (kAlong - 1)); };
  return std::uint64_t{1} << (within(cell[0]) + 4u * within(cell[1]) + 16u * within(cell[2]));
}

/// Cells that may lie within the radius of a position in the middle one, the nearest first.
const std::vector<GridCell>& cells_around() {
  static const std::vector<GridCell> all = [] {
    std::vector<GridCell> cells;
    const std::int64_t reach = floor_to_integer(Support::kRadius / Support::kCell) + 1;
    const auto squared = [](const GridCell& c) { return c[0] * c[0] + c[1] * c[1] + c[2] * c[2]; };
    for (std::int64_t z = -reach; z <= reach; ++z) {
      for (std::int64_t y = -reach; y <= reach; ++y) {
        for (std::int64_t x = -reach; x <= reach; ++x) {
          if (squared({x, y, z}) <= reach * reach) cells.push_back({x, y, z});
        }
      }
    }
    std::stable_sort(cells.begin(), cells.end(), [&](const GridCell& a, const GridCell& b) {
      return squared(a) < squared(b);
    });
    return cells;
  }();
  return all;
}

}  // namespace

void SupportedCells::add(const Vector3d& point_world) {
  if (!is_in_reach(point_world)) return;
  const GridCell cell = grid_cell(point_world, Support::kCell);
  blocks_[grid_key(block_of(cell))] |= bit_of(cell);
}

bool SupportedCells::has(const Vector3d& point_world) const {
  if (!is_in_reach(point_world)) return false;
  const GridCell middle = grid_cell(point_world, Support::kCell);
  GridCell block = block_of(middle);
  auto known = blocks_.find(grid_key(block));
  for (const GridCell& offset : cells_around()) {
    const GridCell cell = {middle[0] + offset[0], middle[1] + offset[1], middle[2] + offset[2]};
    if (block_of(cell) != block) {
      block = block_of(cell);
      known = blocks_.find(grid_key(block));
    }
    if (known == blocks_.end() || (known->second & bit_of(cell)) == 0) continue;
    const Vector3d center = grid_corner(cell, Support::kCell).array() + 0.5 * Support::kCell;
    if ((center - point_world).squaredNorm() <= Support::kRadius * Support::kRadius) return true;
  }
  return false;
}

SupportedCells supported_by(const SurveyOpener& survey) {
  SupportedCells supported;
  const auto reader = cloud_of(survey());
  std::vector<CloudPoint> points;
  while (reader->read(points)) {
    for (const CloudPoint& point : points) supported.add(point.position);
  }
  return supported;
}

SupportedCells supported_by_cloud(const std::string& path) {
  SupportedCells supported;
  const auto reader = open_cloud(path);
  std::vector<CloudPoint> points;
  bool is_empty = true;
  while (reader->read(points)) {
    for (const CloudPoint& point : points) supported.add(point.position);
    is_empty = is_empty && points.empty();
  }
  if (is_empty) throw InputError(fmt::format("{}: no points", path));
  return supported;
}

}  // namespace pointflight
