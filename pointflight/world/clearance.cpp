#include "pointflight/world/clearance.hpp"

#include <algorithm>

namespace pointflight {

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
    const auto nearest = map.nearest(p, radius + reach);
    const double here = nearest ? nearest->distance - radius : reach;
    least = std::min(least, here);
    if (least <= 0.0 || s >= length) return least;
    s = std::min(length, s + std::max(kLeastStep, here - 0.98 * least));
  }
}

}  // namespace pointflight
