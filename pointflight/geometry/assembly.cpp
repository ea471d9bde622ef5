#include "pointflight/geometry/assembly.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"

namespace pointflight {
namespace {

/// A blade where it stands at an instant.
struct Blade {
  Vector3d outward;  ///< From the axis to the tip.
  Vector3d chord;    ///< Across, towards the leading edge.
  Vector3d normal;   ///< Of both.
};

Blade blade_at(const Propeller& propeller, int number, SimTime time) {
  // as a share of a turn: exact for hours
  const double turns = (propeller.phase + propeller.speed * to_seconds(time)) / (2.0 * kPi) +
                       static_cast<double>(number) / propeller.blades;
  const auto angle = math::sincos(2.0 * kPi * (turns - std::floor(turns)));
  const auto pitch = math::sincos(propeller.pitch);
  const double ahead = propeller.speed < 0.0 ? -1.0 : 1.0;
  Blade blade;
  blade.outward = {angle.cos, angle.sin, 0.0};
  blade.chord = {-ahead * pitch.cos * angle.sin, ahead * pitch.cos * angle.cos, pitch.sin};
  blade.normal = blade.outward.cross(blade.chord);
  return blade;
}

/// False if a ray stays farther than `radius` from a position, or has it behind.
bool comes_near(const Vector3d& place, double radius, const Vector3d& o, const Vector3d& d) {
  const Vector3d way = place - o;
  const double along = way.dot(d);
  const double square = way.squaredNorm();
  if (square <= radius * radius) return true;
  return along > 0.0 && square - along * along <= radius * radius;
}

void meet(const Propeller& propeller,
          const Vector3d& o,
          const Vector3d& d,
          SimTime time,
          std::optional<SolidHit>& best) {
  if (!comes_near(propeller.center, propeller.radius + propeller.chord, o, d)) return;
  for (int k = 0; k < propeller.blades; ++k) {
    const Blade blade = blade_at(propeller, k, time);
    const double steep = blade.normal.dot(d);
    if (steep == 0.0) continue;
    const double range = blade.normal.dot(propeller.center - o) / steep;
    if (range < 0.0 || (best && best->range <= range)) continue;
    const Vector3d at = o + range * d - propeller.center;
    const double out = at.dot(blade.outward);
    if (out < propeller.hub_radius || out > propeller.radius) continue;
    if (std::abs(at.dot(blade.chord)) > 0.5 * propeller.chord) continue;
    best = SolidHit{range, steep > 0.0 ? Vector3d(-blade.normal) : blade.normal};
  }
}

}  // namespace

std::optional<SolidHit> intersect(const Assembly& assembly,
                                  const Vector3d& origin,
                                  const Vector3d& direction,
                                  SimTime time) {
  std::optional<SolidHit> best;
  for (const AssemblyPart& part : assembly.parts) {
    const Pose& T = part.T_assembly_part;
    if (!comes_near(T.translation, bounding_radius(part.solid), origin, direction)) continue;
    const Quaterniond back = T.rotation.conjugate();
    const auto met = intersect(part.solid, back * (origin - T.translation), back * direction);
    if (!met || (best && best->range <= met->range)) continue;
    best = SolidHit{met->range, T.rotation * met->normal};
  }
  for (const Propeller& propeller : assembly.propellers) {
    meet(propeller, origin, direction, time, best);
  }
  return best;
}

double bounding_radius(const Assembly& assembly) {
  double radius = 0.0;
  for (const AssemblyPart& part : assembly.parts) {
    radius =
        std::max(radius, part.T_assembly_part.translation.norm() + bounding_radius(part.solid));
  }
  for (const Propeller& p : assembly.propellers) {
    radius = std::max(radius, p.center.norm() + std::hypot(p.radius, 0.5 * p.chord));
  }
  return radius;
}

std::vector<Vector3d> surface_points(const Assembly& assembly, double spacing, SimTime time) {
  std::vector<Vector3d> points;
  for (const AssemblyPart& part : assembly.parts) {
    for (const Vector3d& p : surface_points(part.solid, spacing)) {
      points.push_back(part.T_assembly_part * p);
    }
  }
  for (const Propeller& propeller : assembly.propellers) {
    const double length = propeller.radius - propeller.hub_radius;
    const int along = 2 + static_cast<int>(length / spacing);
    const int across = 1 + static_cast<int>(propeller.chord / spacing);
    for (int k = 0; k < propeller.blades; ++k) {
      const Blade blade = blade_at(propeller, k, time);
      for (int i = 0; i < along * across; ++i) {
        const int row = i / along;
        const double out = propeller.hub_radius + length * (i % along + 0.5) / along;
        const double side = propeller.chord * ((row + 0.5) / across - 0.5);
        points.push_back(propeller.center + out * blade.outward + side * blade.chord);
      }
    }
  }
  return points;
}

}  // namespace pointflight
