// What a beam that hit something brings back to the sensor.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "pointflight/lidar/detection.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/weather.hpp"
#include "pointflight/render/echoes.hpp"
#include "pointflight/render/renderer.hpp"
#include "pointflight/render/wide_beams.hpp"

namespace pointflight {

/// How reflectivities of unknown surfaces are distributed: log-normal. The figures are those that
/// the signals of a real survey gave (a hall at 865 nm, docs/validation.md).
///@{
inline constexpr double kUsualReflectivity = 0.15;  ///< Median; of bodies, all of them.
inline constexpr double kUsualSpread = 0.8;         ///< Standard deviation of the logarithm.
///@}

/// What returns depend on beside the sensor.
struct Surroundings {
  double sun_klx = 100.0;  ///< Background light, kilolux: 100 in full sun, 0 at night.
  /// Of surfaces of which the map does not say it, at the laser's wavelength; 0: it varies from
  /// surfel to surfel, as `kUsualReflectivity` says.
  double reflectivity = 0.0;
  /// Reflectivity of a surface per unit of the map's intensity; 0: what the map says, if it does.
  double reflectivity_per_intensity = 0.0;
  WeatherSettings weather{};  ///< What is in the air.
};

/// Their keys.
void describe(SettingsVisitor& visitor, Surroundings& surroundings);

/// The same with the map's own scale of reflectivities if they give none.
Surroundings surroundings_in(const SurfelMap& map, Surroundings surroundings);

/// The random part of one echo.
struct EchoChance {
  double normal = 0.0;         ///< Standard normal, of the range.
  double detection = 0.0;      ///< Uniform in [0, 1): whether it comes back.
  double drop = 0.0;           ///< Uniform in [0, 1): what the air gives back (`Weather::soft`).
  double drop_position = 0.0;  ///< Uniform in [0, 1).
};

/// The random part of some beams: of most, only the nearest echo's counts.
struct BeamChances {
  std::span<const double> normal;     ///< Of the nearest echo of each beam: standard normal.
  std::span<const double> detection;  ///< Uniform in [0, 1): whether it comes back.
  std::span<const double> place;      ///< Uniform in [0, 1): where a false return lies.
  /// Of an echo that is not the nearest; of what the air gives back the echo is `Echoes::kMost`.
  std::function<EchoChance(std::size_t beam, std::size_t echo)> more;
};

/// One return as the sensor reports it.
struct Return {
  float range = -1.0f;       ///< m; of a depth camera: depth. Negative: no return.
  float intensity = 0.0f;    ///< In the sensor's own unit, or the map's if it has none.
  Label label = kMapLabel;   ///< Of a false one, `kFalseReturn`: nothing, fog, dust or a drop.
  float true_range = -1.0f;  ///< m, without noise and rounding.
  double strength = 0.0;     ///< Of the signal, in the unit of `Weather::target`.
  Origin origin{};           ///< Of what gave most of it.
  std::uint16_t parts = 0;   ///< `Echo::parts`; 0 of a false one.
  float depth = 0.0f;        ///< `Echo::depth`
  /// It is one.
  [[nodiscard]] bool is_return() const { return range >= 0.0f; }
};

/// A sensor's detection, noise and rounding.
class ReturnModel : public EchoReceiver {
 public:
  /// Of a sensor file.
  ReturnModel(const LidarSettings& lidar, const Surroundings& surroundings);

  /// True if draws for the air count.
  [[nodiscard]] bool has_weather() const { return !weather_.is_clear(); }
  /// How far beams have to be followed, m (a depth camera's: depth).
  [[nodiscard]] double reach() const { return reach_; }
  /// Background light, kilolux.
  [[nodiscard]] double sun_klx() const { return surroundings_.sun_klx; }
  /// Which echoes are reported.
  [[nodiscard]] ReturnMode mode() const { return mode_; }
  /// Standard deviation of the range at a range (m) and a margin (`DetectionModel`; infinity if
  /// the sensor has no rated ranges), m.
  [[nodiscard]] double range_sigma(double range, double margin) const;
  /// Of a surface that a beam hit: what the map or the surroundings say, times the cosine
  /// of the incidence.
  [[nodiscard]] double reflectivity(const Hit& hit) const override;
  /// The one echo of a beam that is a line.
  [[nodiscard]] Echo echo_of(const Hit& hit) const;
  /// Of the map's surfaces.
  [[nodiscard]] Reflectances reflectances() const override;
  /// True if scaling the echo's energy by `less` or `more` changes its probability of detection by
  /// more than 0.05.
  [[nodiscard]] bool is_marginal(const Echo& echo, double less, double more) const override;
  [[nodiscard]] SureEchoes sure_echoes() const override;
  [[nodiscard]] bool takes_strongest() const override { return mode_ == ReturnMode::kStrongest; }
  /// What the sensor reports of each beam's echoes, the nearest first, whose ranges are what it
  /// measures: at most `most_returns`, the strongest first, into `returns`, beam by beam, which are
  /// none as yet. None if nothing comes back, or from nearer than the sensor's least range. A beam
  /// whose draw lies below the false alarms' share reports a range anywhere. What is in the air
  /// before the last echo counts as one more, if it is stronger than the surface behind it.
  void measure(std::span<const Echoes> echoes,
               const BeamChances& chances,
               std::span<Return> returns) const;
  /// The same of beams that are lines.
  void measure(std::span<const Hit> hits,
               const BeamChances& chances,
               std::span<Return> returns) const;

 private:
  struct Block;
  template <class Seen>
  void measure_all(std::size_t count,
                   const Seen& seen_by,
                   const BeamChances& chances,
                   std::span<Return> returns) const;
  template <class Seen>
  void report(const Block& block,
              const Seen& seen_by,
              const BeamChances& chances,
              std::span<Return> returns) const;
  void take_surface(const Echo& echo, double reflectivity, float measured, Return& made) const;
  [[nodiscard]] Return from_air(double range, const EchoChance& chance) const;
  [[nodiscard]] Return from_nothing(double place) const;
  void choose(std::span<Return> seen, std::span<Return> returns) const;
  [[nodiscard]] float rounded(double range) const;
  [[nodiscard]] std::vector<float> sure_reflectivities() const;

  RangeNoiseSettings noise_;
  Surroundings surroundings_;
  DetectionModel detection_;
  double reach_ = 0.0;
  Weather weather_;
  double false_alarm_ = 0.0;
  double intensity_scale_ = 0.0;
  double air_kept_ = 1.0;  ///< Share of returns of the air that no filter takes out.
  double range_min_ = 0.0;
  ReturnMode mode_;
  std::vector<float> sure_;  ///< `SureEchoes::reflectivities`
};

}  // namespace pointflight
