#pragma once

#include <algorithm>
#include <optional>

#include "pointflight/map/body.hpp"

namespace pointflight {

/// The nearest thing to a hull.
struct Contact {
  double distance = 0.0;                       ///< m; negative if they overlap: minus the depth.
  Vector3d position_world = Vector3d::Zero();  ///< Of the thing, about where it is nearest.
  Label label = kMapLabel;                     ///< What the thing is.
};

/// Distance of a hull to the map within `reach`; nothing if all is farther. To the surfels'
/// boxes (map/internal/near_surfels.hpp), so that collisions and rays see the same surface. Where a
/// ball's centre lies inside a box the distance is minus its radius.
std::optional<Contact> contact_with_map(const SurfelMap& map,
                                        const Solid& hull,
                                        const Pose& T_world_hull,
                                        double reach);

/// The same to a body that stands at a pose.
std::optional<Contact> contact_with_body(const BodyShape& shape,
                                         const Pose& T_world_body,
                                         Label label,
                                         const Solid& hull,
                                         const Pose& T_world_hull,
                                         double reach);

/// The first share of a step, from 0 to 1, at which `distance_at(share)` is not positive, by
/// conservative advancement (Mirtich 1996): nothing can happen sooner than the distance allows.
/// `moved` bounds what the distance can change by over the whole step, m. Contacts of which less
/// than a tenth of a millimetre of the way lies inside may be passed over: 5 nm deep for a ball of
/// 0.25 m.
template <class DistanceAt>
std::optional<double> first_contact(const DistanceAt& distance_at, double moved) {
  constexpr double kLeastAdvance = 1e-4;  // m
  for (double share = 0.0;;) {
    const double distance = distance_at(share);
    if (distance <= 0.0) return share;
    if (share >= 1.0 || distance > (1.0 - share) * moved) return std::nullopt;
    share = std::min(1.0, share + std::max(distance, kLeastAdvance) / moved);
  }
}

/// No point within `radius` of the origin of a body moves farther than this between two poses, m
/// (along a straight line and a shortest turn).
double motion_bound(const Pose& from, const Pose& to, double radius);

}  // namespace pointflight
