#include "pointflight/world/clearance.hpp"

#include <algorithm>

namespace pointflight {

std::optional<Clearance> clearance(const SurfelMap& map,
                                   const Vector3d& center_world,
                                   double radius,
                                   double reach) {
  const auto nearest = map.nearest(center_world, radius + reach);
  if (!nearest) return std::nullopt;
  return Clearance{nearest->distance - radius, nearest->center_world};
}

double clearance_along(const SurfelMap& map,
                       const Vector3d& a_world,
                       const Vector3d& b_world,
                       double radius,
                       double reach) {
  constexpr double kLeastStep = 1e-3;
  const double length = (b_world - a_world).norm();
  double least = reach;
  // within half of what a point is clear by, nothing can come closer than the other half
  for (double s = 0.0;;) {
    const Vector3d p =
        length > 0.0 ? Vector3d(a_world + (s / length) * (b_world - a_world)) : a_world;
    const auto found = clearance(map, p, radius, reach);
    const double here = found ? found->distance : reach;
    least = std::min(least, here);
    if (least <= 0.0 || s >= length) return least;
    s = std::min(length, s + std::max(kLeastStep, here - 0.98 * least));
  }
}

}  // namespace pointflight
