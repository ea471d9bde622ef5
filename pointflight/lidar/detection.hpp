// Which beams are detected: a link budget calibrated to the ranges that a data sheet states.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "pointflight/core/settings.hpp"

namespace pointflight {

struct SignalFigures;

/// How far a sensor sees a diffuse (Lambertian) target that it looks at face on.
struct RatedRange {
  double reflectivity = 0.1;  ///< Of the target, 0 to 1.
  double range = 100.0;       ///< m
  double sun_klx = 100.0;     ///< In such light, kilolux.
  /// The same figures.
  bool operator==(const RatedRange&) const = default;
};

/// What a receiver sees of a target so near that the beam and its field of view do not overlap
/// fully, or that its optics are not in focus.
struct NearShare {
  double range = 1.0;  ///< m
  double share = 1.0;  ///< Of the signal that it would see otherwise.
  /// The same figures.
  bool operator==(const NearShare&) const = default;
};

/// Which echoes of a beam a sensor reports.
enum class ReturnMode {
  kStrongest,  ///< One: the strongest.
  kFirst,      ///< One: the nearest.
  kLast,       ///< One: the farthest.
  kDual,       ///< The strongest and the last; if these are one, the second strongest.
  kTriple,     ///< The three strongest.
};

/// Of one beam.
std::size_t most_returns(ReturnMode mode);
/// Their names in sensor files.
std::span<const Named<ReturnMode>> return_modes();

/// The `detection` section of a sensor file.
struct DetectionSettings {
  std::vector<RatedRange> rated;  ///< None: whatever a beam hits comes back.
  double probability = 0.5;       ///< Of a return at the rated ranges.
  double false_alarm = 1e-4;      ///< Share of beams that report what is not there.
  double air_filter = 0.0;        ///< Share of returns of fog, dust and drops that it takes out.
  /// By ascending range; straight lines between, the first one's share below, all beyond.
  std::vector<NearShare> near;
  double range_limit = 0.0;  ///< m, nothing farther is reported however bright; 0: no limit.
  /// What the sensor reports of a diffuse target of 100 %, face on; 0: the map's intensity.
  double intensity_at_100_percent = 0.0;
  ReturnMode returns = ReturnMode::kStrongest;  ///< Where a beam has several echoes.
};

/// The keys of the section.
void describe(SettingsVisitor& visitor, DetectionSettings& settings);

/// Probability of a return by the signal's strength.
///
/// The signal counts by its *margin*: how many times stronger it is than one from a target that the
/// sensor is rated for. By the link budget the margin of a diffuse surface is
/// (rho cos(incidence) / 0.1) (R10 / R)^(1 / gamma), with gamma = 0.5 if the sun does not matter
/// and less if sheets say so (0.25 for an Avia at 100 klx). Here the law is the sheet's own:
/// rated ranges are met exactly, and lie on a straight line in (log reflectivity, log range)
/// between and beyond. With one rated range gamma is 0.5. Light changes the ranges in proportion
/// between the levels that are rated, and keeps the nearest level's beyond. Signals from within
/// `DetectionSettings::near` are weakened by its share.
class DetectionModel {
 public:
  /// `settings` as `describe` admits; `sun_klx`: background light, 0 at night, 100 in full sun.
  DetectionModel(const DetectionSettings& settings, double sun_klx);

  /// True if every beam that hits something comes back.
  [[nodiscard]] bool is_ideal() const { return log_ranges_.empty(); }
  /// Rated range of a diffuse target of this reflectivity (> 0), face on, m.
  [[nodiscard]] double rated_range(double reflectivity) const;
  /// Reflectivity of the target that is rated for a range (> 0, m); above 1 for one that no diffuse
  /// target reaches.
  [[nodiscard]] double rated_reflectivity(double range) const;
  /// Share of the signal that is seen from `range` (m), by `near`.
  [[nodiscard]] double near_gain(double range) const;
  /// Margin of a signal that comes back so often, 0 to 1, both exclusive: `probability`, inverted.
  [[nodiscard]] double margin_at(double probability) const;
  /// Of the signal from `range` (> 0, m); `reflectivity` is the surface's times the cosine of the
  /// incidence, times what the air lets through, there and back.
  [[nodiscard]] double margin(double reflectivity, double range) const;
  /// Signal of margin 1 by the pure link budget, in the unit of `Weather::target`: rho / R^2 of the
  /// darkest rated target.
  [[nodiscard]] double least_strength() const;
  /// Of a threshold detector amid Gaussian noise: Phi((T + z) m - T), T = Phi^-1(1 - false_alarm),
  /// z = Phi^-1(probability at m = 1).
  [[nodiscard]] double probability(double margin) const;
  /// No diffuse target comes back from farther than this with a probability above 0.001, m;
  /// `range_limit` if that is less.
  [[nodiscard]] double reach() const;
  /// What `measure_signals` needs of this model, which must outlive it.
  [[nodiscard]] SignalFigures figures() const;

 private:
  std::vector<double> log_reflectivities_;  ///< Of targets, ascending; two at least, or none.
  std::vector<double> log_ranges_;          ///< Rated for these; ascending, too.
  double threshold_ = 0.0;                  ///< T
  double slope_ = 0.0;                      ///< T + z
  double limit_ = 0.0;                      ///< `range_limit`
  std::vector<double> near_ranges_;         ///< Of `near`, two at least, or none.
  std::vector<double> near_shares_;         ///< Beside them.
};

}  // namespace pointflight
