#include "pointflight/map/edit/crop_region.hpp"

namespace pointflight {

bool polygon_contains(const std::vector<std::array<double, 2>>& polygon, double x, double y) {
  bool inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const auto& [ax, ay] = polygon[i];
    const auto& [bx, by] = polygon[j];
    if ((ay > y) == (by > y)) continue;
    if (x < ax + (bx - ax) * (y - ay) / (by - ay)) inside = !inside;
  }
  return inside;
}

bool CropRegion::contains(const Vector3d& point) const {
  bool within = true;
  if (box)
    within = (point.array() >= box->min.array()).all() && (point.array() <= box->max.array()).all();
  if (within && !polygon.empty()) within = polygon_contains(polygon, point.x(), point.y());
  if (within && ground) {
    const double height = point.z() - ground->at(point.x(), point.y());
    within = height >= above_ground_min && height <= above_ground_max;
  }
  return within != outside;
}

}  // namespace pointflight
