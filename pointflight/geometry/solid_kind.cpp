#include "pointflight/geometry/solid_kind.hpp"

#include <algorithm>

namespace pointflight {

Registry<SolidKind>& SolidKind::table() {
  const auto sphere = [](const SolidSize& s) -> Solid { return Sphere{s.radius}; };
  const auto box = [](const SolidSize& s) -> Solid { return Box{0.5 * s.size}; };
  const auto cylinder = [](const SolidSize& s) -> Solid {
    return Cylinder{s.radius, 0.5 * s.height};
  };
  const auto capsule = [](const SolidSize& s) -> Solid {
    return Capsule{s.radius, std::max(0.0, 0.5 * s.height - s.radius)};
  };
  static Registry<SolidKind> table = {
      {.name = "sphere", .has_radius = true, .make = sphere},
      {.name = "box", .has_size = true, .make = box},
      {.name = "cylinder", .has_radius = true, .has_height = true, .make = cylinder},
      {.name = "capsule",
       .has_radius = true,
       .has_height = true,
       .has_caps = true,
       .make = capsule},
  };
  return table;
}

std::string kinds_with(bool SolidKind::*size) {
  std::string names;
  for (const SolidKind& kind : SolidKind::table().rows()) {
    if (size == nullptr || kind.*size) names += (names.empty() ? "shape: " : ", ") + kind.name;
  }
  return names;
}

const char* fault_of_height(const SolidKind& kind, double height, double radius) {
  const bool is_less = kind.has_caps && height < 2.0 * radius;
  return is_less ? "less than twice the radius: that is a sphere" : nullptr;
}

void describe_solid(SettingsVisitor& v, const SolidKind* kind, SolidSize& s, double most) {
  const auto has = [&](bool SolidKind::*size) { return kind != nullptr && kind->*size; };
  v.only_if(has(&SolidKind::has_radius), kinds_with(&SolidKind::has_radius), [&](auto& w) {
    w.value({"radius", "m", "of a round shape", 0.001, most}, s.radius);
  });
  v.only_if(has(&SolidKind::has_height), kinds_with(&SolidKind::has_height), [&](auto& w) {
    w.value({"height", "m", "along z, a capsule's caps included", 0.001, most}, s.height);
  });
  v.only_if(has(&SolidKind::has_size), kinds_with(&SolidKind::has_size), [&](auto& w) {
    w.value({"size", "m", "sides of the box", 0.001, most}, s.size);
  });
}

}  // namespace pointflight
