// What fog, dust, rain and snow do to a LiDAR's beams.
#pragma once

#include <optional>
#include <vector>

#include "pointflight/core/settings.hpp"

namespace pointflight {

/// What is in the air.
enum class WeatherKind {
  kClear,  ///< Nothing.
  kFog,    ///< Droplets: `visibility`.
  kDust,   ///< As fog of the same visibility; carried in dry air.
  kRain,   ///< `rate`.
  kSnow,   ///< `rate`.
};

/// The `weather` section of a scenario's surroundings.
struct WeatherSettings {
  WeatherKind kind = WeatherKind::kClear;  ///< Which of the figures below counts.
  /// Meteorological optical range, m: at which 5 % of the light is left.
  double visibility = 200.0;
  double rate = 10.0;  ///< Precipitation, mm of water per hour.
};

/// The keys of the section.
void describe(SettingsVisitor& visitor, WeatherSettings& settings);

/// Extinction and what comes back from the air itself.
///
/// Strengths are those of a received signal, in the unit in which a diffuse target of reflectivity
/// rho at range R gives rho e^(-2 alpha R) / R^2 (`target`).
///
/// Fog and dust: alpha = ln 20 / visibility, backscatter beta = 0.046 / visibility; the signal from
/// range R is that of the pulse's length, pi beta times the integral of
/// sin^2(pi t / 2 tau) e^(-2 alpha r) xi(r) / r^2 over r = R - c t / 2, tau the pulse's width at
/// half its power, xi the overlap of beam and receiver, 0 up to 0.9 m and 1 from 1 m on (Hahner et
/// al., ICCV 2021, who take tau = 20 ns).
///
/// Rain and snow: drops of diameters D (mm) with N(D) = N0 e^(-L D) per m^3 and mm, L = 4.1 R^-0.21
/// and N0 = 8000 for rain (Marshall, Palmer 1948), L = 2.55 R^-0.48 and N0 = 7600 R^-0.87 for snow,
/// of which alpha = 1e-6 pi N0 / L^3 (geometric optics, Q = 2). A drop in the beam gives
/// ((n - 1) / (n + 1))^2 min((D / beam diameter)^2, 1) e^(-2 alpha r) / r^2; of all drops in the
/// beam's cone the strongest counts (Kilic et al., LISA, arXiv 2107.07004).
class Weather {
 public:
  /// `divergence`: mean full angle of the beam, rad (> 0); `pulse`: its width, s (> 0); signals
  /// from nearer than `nearest` m are not seen, nor from farther than `reach`.
  Weather(const WeatherSettings& settings,
          double divergence,
          double pulse,
          double nearest,
          double reach);

  /// False in clear air.
  [[nodiscard]] bool is_clear() const { return kind_ == WeatherKind::kClear; }
  /// alpha, 1/m.
  [[nodiscard]] double extinction() const { return extinction_; }
  /// What is left of light over `range` m, there and back.
  [[nodiscard]] double left_after(double range) const;
  /// Strength of a target's signal, its reflectivity with the cosine of the incidence.
  [[nodiscard]] double target(double reflectivity, double range) const;

  /// A signal out of the air.
  struct Soft {
    double range = 0.0;     ///< m
    double strength = 0.0;  ///< As of `target`.
  };
  /// The strongest one before `range` m, by two uniforms in [0, 1): for fog they are where within
  /// its peak, for drops how strong the strongest is and where. None if nothing comes back.
  [[nodiscard]] std::optional<Soft> soft(double range, double first, double second) const;

 private:
  void set_up_fog(double visibility, double pulse, double nearest, double reach);
  void set_up_drops(double rate, double divergence, double nearest, double reach);
  void tabulate_drops();
  [[nodiscard]] std::optional<Soft> fog_before(double range, double first) const;
  [[nodiscard]] std::optional<Soft> drop_before(double range, double first, double second) const;
  [[nodiscard]] double drops_in(std::size_t cell, double strength) const;

  WeatherKind kind_;
  double extinction_ = 0.0;
  double divergence_ = 0.0;

  /// Of fog: signal by range, in steps.
  std::vector<double> signal_;
  std::vector<std::size_t> best_;  ///< Index of the strongest up to each.

  /// Of drops: cells along the beam, each with the middle's range and the volume, m^3.
  struct Cell {
    double range, volume;
  };
  std::vector<Cell> cells_;
  std::vector<double> strengths_;  ///< Descending.
  /// Expected number of drops in the first k cells that are stronger, k from 0 to all, for each
  /// strength.
  std::vector<double> stronger_;
  double drops_ = 0.0;      ///< N0, per m^3 and mm.
  double steepness_ = 0.0;  ///< L, 1/mm.
  double fresnel_ = 0.0;    ///< ((n - 1) / (n + 1))^2
};

}  // namespace pointflight
