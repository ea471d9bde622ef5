#include "pointflight/survey/surveyed_cells.hpp"

#include "pointflight/geometry/internal/grid_cells.hpp"

namespace pointflight {
namespace {

constexpr double kCell = 0.1;  // m

/// Of whole numbers of cells; NaN is not.
bool is_in_reach(const Vector3d& p) {
  return p.cwiseAbs().maxCoeff() < 1e9 && p.allFinite();
}

}  // namespace

void SurveyedCells::add(const Vector3d& point_world) {
  if (!is_in_reach(point_world)) return;
  cells_.insert(grid_key(grid_cell(point_world, kCell)));
}

bool SurveyedCells::has(const Vector3d& point_world) const {
  if (!is_in_reach(point_world)) return false;
  const GridCell middle = grid_cell(point_world, kCell);
  for (std::int64_t i = 0; i < 27; ++i) {
    if (cells_.contains(grid_key(neighbour(middle, i)))) return true;
  }
  return false;
}

SurveyedCells surveyed_cells(const SurveyOpener& survey) {
  SurveyedCells seen;
  const auto reader = cloud_of(survey());
  std::vector<CloudPoint> points;
  while (reader->read(points)) {
    for (const CloudPoint& point : points) seen.add(point.position);
  }
  return seen;
}

}  // namespace pointflight
