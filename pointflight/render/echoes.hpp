// Where the light of a beam comes back from: a beam is wide, and parts of it may hit different
// things.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "pointflight/map/body.hpp"
#include "pointflight/render/hit.hpp"

namespace pointflight {

/// Which sub-ray gave the most light of a return, and what it hit: no sensor knows.
struct Origin {
  float cos_incidence = 0.0f;        ///< `Hit::cos_incidence`
  std::uint32_t surfel = kNoSurfel;  ///< `Hit::surfel`
  std::uint16_t sub_ray = 0;         ///< Its number; the spread of numbers is `Footprint`'s.
};

/// What part of a beam hit.
struct BeamPart {
  float range = -1.0f;        ///< m; negative: nothing.
  float share = 1.0f;         ///< Of the beam's light.
  float reflectivity = 0.0f;  ///< Of the surface, times the cosine of the incidence.
  float intensity = 0.0f;     ///< The map's.
  Label label = kMapLabel;    ///< What it is of.
  Origin origin{};            ///< Of itself.
  /// It hit something.
  [[nodiscard]] bool is_return() const { return range >= 0.0f; }
};

/// One pulse that comes back.
struct Echo {
  float range = -1.0f;        ///< m: mean over its parts, by their energy.
  float reflectivity = 0.0f;  ///< Of a target as wide as the beam that gave as much light.
  float intensity = 0.0f;     ///< The map's: mean over its parts, by their energy.
  Label label = kMapLabel;    ///< Of the part that gave most.
  std::uint16_t parts = 0;    ///< How many.
  float depth = 0.0f;         ///< From the nearest to the farthest part, m.
  Origin origin{};            ///< The part that gave most.
  /// It comes from somewhere.
  [[nodiscard]] bool is_return() const { return range >= 0.0f; }
};

/// The echoes of one beam, the nearest first.
struct Echoes {
  static constexpr std::size_t kMost = 4;  ///< The strongest are kept.
  std::array<Echo, kMost> all{};           ///< The first `count` of these.
  std::uint32_t count = 0;                 ///< How many there are.
  bool all_hit = false;                    ///< All of the beam hit something: no light goes on.
  /// Them.
  [[nodiscard]] std::span<const Echo> span() const { return {all.data(), count}; }
};

/// m: energy goes with 1 / range^2 from there on.
inline constexpr float kNearestEcho = 0.01f;

/// Strength of its signal, in the unit of `Weather::target`.
double energy_of(const Echo& echo);

/// Parts of a beam as the receiver tells them apart: those that follow within `merge` (m, half a
/// pulse's length, c tau / 2) of each other in range are one pulse. Sorts `parts`.
Echoes echoes_of(std::span<BeamPart> parts, float merge);

/// Adds an echo behind the others; of too many the weakest is left out.
void add_echo(const Echo& echo, Echoes& echoes);

/// All parts as one pulse, however far apart: a surface that the beam grazes stretches it.
Echo merged(std::span<const BeamPart> parts);

}  // namespace pointflight
