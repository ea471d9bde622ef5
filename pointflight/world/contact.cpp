#include "pointflight/world/contact.hpp"

#include "pointflight/core/constants.hpp"
#include "pointflight/map/internal/near_surfels.hpp"

namespace pointflight {
namespace {

/// A ball that holds a surfel's box.
double box_radius(const SurfelBox& box) {
  return box.half.norm();
}

/// The axis-aligned box around a hull at a pose.
Aabb box_around(const Solid& hull, const Pose& pose) {
  const Vector3d half = pose.rotation.toRotationMatrix().cwiseAbs() * half_extent(hull);
  Aabb box;
  box.add(pose.translation - half);
  box.add(pose.translation + half);
  return box;
}

}  // namespace

std::optional<Contact> contact_with_map(const SurfelMap& map,
                                        const Solid& hull,
                                        const Pose& T_world_hull,
                                        double reach) {
  if (const auto* ball = std::get_if<Sphere>(&hull)) {
    const auto nearest = map.nearest(T_world_hull.translation, ball->radius + reach);
    if (!nearest) return std::nullopt;
    return Contact{nearest->distance - ball->radius, nearest->center_world, kMapLabel};
  }
  const Pose T_hull_world = T_world_hull.inverse();
  std::optional<Contact> best;
  double least = reach;
  const auto visit = [&](const SurfelBox& box) {
    // cheap first: the hull's distance to the box' centre
    const double to_center = signed_distance(hull, T_hull_world * box.T_world_box.translation);
    if (to_center - box_radius(box) <= least) {
      const Separation s = separation(hull, T_world_hull, Solid{Box{box.half}}, box.T_world_box);
      if (s.distance <= least) {
        least = s.distance;
        best = Contact{s.distance, s.point, kMapLabel};
      }
    }
    // of what touches, something else can still be deeper
    return std::max(0.0, least);
  };
  visit_near(map, box_around(hull, T_world_hull), reach, visit);
  return best;
}

std::optional<Contact> contact_with_body(const BodyShape& shape,
                                         const Pose& T_world_body,
                                         Label label,
                                         const Solid& hull,
                                         const Pose& T_world_hull,
                                         double reach) {
  const double centers = (T_world_body.translation - T_world_hull.translation).norm();
  if (centers - bounding_radius(shape) - bounding_radius(hull) > reach) return std::nullopt;
  std::optional<Contact> contact;
  if (const auto* solid = std::get_if<Solid>(&shape)) {
    const Separation s = separation(hull, T_world_hull, *solid, T_world_body);
    if (s.distance > reach) return std::nullopt;
    contact = Contact{s.distance, s.point, label};
  } else {
    const auto& points = std::get<std::shared_ptr<const SurfelMap>>(shape);
    contact = contact_with_map(*points, hull, T_world_body.inverse() * T_world_hull, reach);
    if (!contact) return std::nullopt;
    contact->position_world = T_world_body * contact->position_world;
    contact->label = label;
  }
  return contact;
}

double motion_bound(const Pose& from, const Pose& to, double radius) {
  // an angle is at most pi times the sine of its half, up to half a turn
  const double turn = kPi * (from.rotation.conjugate() * to.rotation).vec().norm();
  return (to.translation - from.translation).norm() + turn * radius;
}

}  // namespace pointflight
