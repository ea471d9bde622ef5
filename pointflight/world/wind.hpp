#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "pointflight/core/settings.hpp"
#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Strength of Dryden gusts (MIL-F-8785C).
enum class Turbulence {
  kNone,      ///< Calm air.
  kLight,     ///< Wind of 15 knots at 20 feet.
  kModerate,  ///< 30 knots.
  kSevere,    ///< 45 knots.
  kCustom,    ///< `gust_sigma` and `gust_length`.
};

/// How the air moves.
struct WindSettings {
  Vector3d mean = Vector3d::Zero();             ///< Where it blows to, world, m/s.
  Turbulence turbulence = Turbulence::kNone;    ///< How gusty.
  Vector3d gust_sigma = Vector3d::Zero();       ///< custom: along, across, up, m/s
  Vector3d gust_length = Vector3d(50, 50, 20);  ///< custom: scale lengths, m
};

/// The keys of `air.wind`.
void describe(SettingsVisitor& visitor, WindSettings& settings);

/// What a vehicle's gusts remember, in units of their deviations: a value.
struct GustState {
  double along = 0.0;              ///< State of the first-order filter of the along-wind gusts.
  std::array<double, 2> across{};  ///< States of the second-order filter across the wind.
  std::array<double, 2> up{};      ///< States of the second-order filter of the vertical gusts.
  /// False: the filters draw their first state from the stationary distribution.
  bool started = false;
};

/// Deviations (m/s) and scale lengths (m) of gusts along the mean wind, across it and up.
struct GustScales {
  Vector3d sigma;   ///< Standard deviations, m/s: along, across, up.
  Vector3d length;  ///< Scale lengths, m: along, across, up.
};

/// MIL-F-8785C, 3.7.3.4, low altitudes: of `height` above ground (m, 3.048 to 304.8) and the wind
/// at 20 feet (m/s): sigma_w = 0.1 W20, L_w = h, sigma_u = sigma_w / (0.177 + 0.000823 h)^0.4, L_u
/// = h / (0.177 + 0.000823 h)^1.2 with h in feet.
GustScales low_altitude_gusts(double height, double wind_at_20_feet);

/// Wind with Dryden turbulence (MIL-F-8785C, 3.7.1.2): along
/// Phi_u(W) = sigma^2 2L/pi / (1 + (L W)^2), across and up
/// Phi_v(W) = sigma^2 L/pi (1 + 3 (L W)^2) / (1 + (L W)^2)^2, met at the vehicle's speed through
/// the air. Every vehicle has gusts of its own; draws are addressed by (seed, vehicle, step).
class Wind {
 public:
  /// The seed is the vehicle's own, or the run's.
  Wind(const WindSettings& settings, std::uint64_t seed) : settings_(settings), seed_(seed) {}

  /// Wind (world, m/s) over physics step number `step` of `dt` seconds, for a vehicle with velocity
  /// `v_world` at `height` (m) above ground. Exact for these spectra at any `dt`.
  [[nodiscard]] Vector3d over_step(GustState& state,
                                   std::uint32_t vehicle,
                                   std::uint64_t step,
                                   double dt,
                                   const Vector3d& v_world,
                                   double height) const;

  /// True without mean wind and gusts: `over_step` need not be called.
  [[nodiscard]] bool is_calm() const {
    return settings_.mean.isZero(0.0) && settings_.turbulence == Turbulence::kNone;
  }

 private:
  [[nodiscard]] GustScales scales(double height) const;

  WindSettings settings_;
  std::uint64_t seed_;
};

}  // namespace pointflight
