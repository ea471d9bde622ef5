// Solids as files name them: one list for hulls and obstacles.
#pragma once

#include <string>

#include "pointflight/core/registry.hpp"
#include "pointflight/core/settings.hpp"
#include "pointflight/geometry/solid.hpp"

namespace pointflight {

/// The sizes that a file gives; each kind uses those that it has.
struct SolidSize {
  double radius = 0.0;               ///< m
  double height = 0.0;               ///< Along z, all of it, m.
  Vector3d size = Vector3d::Zero();  ///< Sides, m.
};

/// A row of the table of solids.
struct SolidKind {
  static constexpr const char* kWhat = "shape";  ///< In messages.
  /// "sphere", the first, "box", "cylinder", "capsule".
  static Registry<SolidKind>& table();

  std::string name;                   ///< In files.
  bool has_radius = false;            ///< `SolidSize::radius` counts.
  bool has_height = false;            ///< `SolidSize::height` counts.
  bool has_size = false;              ///< `SolidSize::size` counts.
  bool has_caps = false;              ///< Round ends, which the height includes.
  Solid (*make)(const SolidSize& s);  ///< Of sizes above 0; a capsule is a sphere at least.
};

/// "shape: sphere, cylinder": kinds with a size, or all, as the condition of a key names them.
std::string kinds_with(bool SolidKind::*size = nullptr);

/// What is wrong with a height for this radius (m), for users; null: nothing.
const char* fault_of_height(const SolidKind& kind, double height, double radius);

/// The keys `radius`, `height` and `size`, each up to `most` m, of the kinds that have them; null:
/// none has.
void describe_solid(SettingsVisitor& visitor, const SolidKind* kind, SolidSize& sizes, double most);

}  // namespace pointflight
