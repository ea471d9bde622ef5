#include "pointflight/lidar/return_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/floor.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/lidar/internal/return_kernel.hpp"

namespace pointflight {
namespace {

constexpr double kDarkest = 1e-3;                   // reflectivity of anything
constexpr double kShortestPulse = 0.1;              // ns
constexpr double kBrightest = 255.0;                // a byte, in every vendor's packets
constexpr double kUsualDivergence = 0.2 * kDegree;  // rad, if a sensor file gives none

constexpr std::size_t kSureSteps = 128;  // of `SureEchoes`
constexpr std::size_t kTexture = 4096;   // reflectivities that unknown surfels have

/// Quantiles of the usual distribution.
std::vector<float> usual_quantiles() {
  std::vector<float> all(kTexture);
  for (std::size_t i = 0; i < kTexture; ++i) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(kTexture);
    all[i] = static_cast<float>(
        std::min(1.0, kUsualReflectivity * math::exp(kUsualSpread * math::normal_quantile(share))));
  }
  return all;
}

const std::vector<float>& usual_reflectivities() {
  static const std::vector<float> all = usual_quantiles();
  return all;
}

/// Of a hit of a beam that is a line.
Echo echo_with(const Hit& hit, float reflectivity) {
  return {.range = hit.range,
          .reflectivity = reflectivity,
          .intensity = hit.intensity,
          .label = hit.label,
          .parts = 1,
          .origin = {hit.cos_incidence, hit.surfel}};
}

/// Mean full angle of the beam, rad.
double divergence_of(const OpticsSettings& optics) {
  const double mean =
      0.5 * (optics.divergence_horizontal_deg + optics.divergence_vertical_deg) * kDegree;
  return mean > 0.0 ? mean : kUsualDivergence;
}

}  // namespace

void describe(SettingsVisitor& v, Surroundings& s) {
  v.value({"sun_klx", "klx", "background light: 100 in full sun, 0 at night", 0, 200}, s.sun_klx);
  v.value({"reflectivity",
           "",
           "of surfaces of which the map does not say it, at the laser's wavelength; 0: it varies "
           "from surfel to surfel, half of them above 0.15",
           0,
           1},
          s.reflectivity);
  v.value({"reflectivity_per_intensity",
           "",
           "of the map's surfaces, per unit of its intensity; 0: what the map says, if it does",
           0,
           1e6},
          s.reflectivity_per_intensity);
  v.section({"weather", "", "what is in the air"},
            [&](SettingsVisitor& w) { describe(w, s.weather); });
}

Surroundings surroundings_in(const SurfelMap& map, Surroundings surroundings) {
  if (surroundings.reflectivity_per_intensity <= 0.0 && map.has_intensity()) {
    surroundings.reflectivity_per_intensity = map.reflectivity_per_intensity();
  }
  return surroundings;
}

ReturnModel::ReturnModel(const LidarSettings& lidar, const Surroundings& surroundings)
    : noise_(lidar.noise),
      surroundings_(surroundings),
      detection_(lidar.detection, surroundings.sun_klx),
      reach_(detection_.is_ideal() ? lidar.range_max : detection_.reach()),
      weather_(detection_.is_ideal() ? WeatherSettings{} : surroundings.weather,
               divergence_of(lidar.optics),
               1e-9 * std::max(kShortestPulse, lidar.optics.pulse_ns),
               lidar.range_min,
               reach_),
      false_alarm_(detection_.is_ideal() ? 0.0 : lidar.detection.false_alarm),
      intensity_scale_(lidar.detection.intensity_at_100_percent),
      air_kept_(1.0 - lidar.detection.air_filter),
      range_min_(lidar.range_min),
      mode_(lidar.detection.returns),
      sure_(sure_reflectivities()) {}

double ReturnModel::reflectivity(const Hit& hit) const {
  double reflectivity = surroundings_.reflectivity;
  if (hit.label == kMapLabel && surroundings_.reflectivity_per_intensity > 0.0) {
    reflectivity = static_cast<double>(hit.intensity) * surroundings_.reflectivity_per_intensity;
  } else if (reflectivity <= 0.0) {
    reflectivity = hit.surfel == kNoSurfel
                       ? kUsualReflectivity
                       : static_cast<double>(usual_reflectivities()[usual_number(hit.surfel)]);
  }
  return std::max(kDarkest, reflectivity * static_cast<double>(hit.cos_incidence));
}

Echo ReturnModel::echo_of(const Hit& hit) const {
  if (!hit.is_return()) return {};
  return echo_with(hit, static_cast<float>(reflectivity(hit)));
}

Reflectances ReturnModel::reflectances() const {
  const bool says =
      surroundings_.reflectivity_per_intensity > 0.0 || surroundings_.reflectivity > 0.0;
  return {.per_intensity = static_cast<float>(surroundings_.reflectivity_per_intensity),
          .same = static_cast<float>(surroundings_.reflectivity),
          .usual = says ? nullptr : usual_reflectivities().data(),
          .least = static_cast<float>(kDarkest)};
}

bool ReturnModel::is_marginal(const Echo& echo, double less, double more) const {
  if (detection_.is_ideal()) return false;
  const auto range = static_cast<double>(echo.range);
  const double margin =
      detection_.margin(static_cast<double>(echo.reflectivity) * weather_.left_after(range),
                        std::max(range, kNearestSignal));
  return detection_.probability(more * margin) - detection_.probability(less * margin) > 0.05;
}

std::vector<float> ReturnModel::sure_reflectivities() const {
  if (detection_.is_ideal()) return {};
  // a quarter less is seen with a probability that is 0.05 from certain
  const double margin = detection_.margin_at(0.95) / 0.75;
  std::vector<float> sure(kSureSteps);
  for (std::size_t i = 0; i < kSureSteps; ++i) {
    for (const std::size_t edge : {i, i + 1}) {
      const double range =
          std::max(kNearestSignal, reach_ * static_cast<double>(edge) / double{kSureSteps});
      const double of_white = detection_.margin(weather_.left_after(range), range);
      sure[i] = std::max(sure[i], static_cast<float>(margin / of_white));
    }
  }
  return sure;
}

SureEchoes ReturnModel::sure_echoes() const {
  return {.reflectivities = sure_,
          .steps_per_m = static_cast<float>(double{kSureSteps} / std::max(1e-3, reach_))};
}

double ReturnModel::range_sigma(double range, double margin) const {
  const double far = noise_.range_sigma_per_m2 * range * range;
  const double weak = noise_.range_sigma_at_limit / margin;
  return std::sqrt(noise_.range_sigma * noise_.range_sigma + far * far + weak * weak);
}

float ReturnModel::rounded(double range) const {
  const double step = noise_.range_step;
  if (step > 0.0) range = step * static_cast<double>(floor_to_integer(range / step + 0.5));
  return static_cast<float>(range);
}

/// What `echo` reports that is measured at `measured`; of `reflectivity`, what the air has left.
void ReturnModel::take_surface(const Echo& echo,
                               double reflectivity,
                               float measured,
                               Return& made) const {
  const double near = std::max(static_cast<double>(echo.range), kNearestSignal);
  made.range = measured;
  made.intensity = intensity_scale_ > 0.0
                       ? static_cast<float>(std::min(kBrightest, intensity_scale_ * reflectivity))
                       : echo.intensity;
  made.label = echo.label;
  made.true_range = echo.range;
  made.strength = reflectivity / (near * near);
  made.origin = echo.origin;
  made.parts = echo.parts;
  made.depth = echo.depth;
}

/// What fog or a drop within `range` gives. Its margin is by the pure link budget from the darkest
/// rated target on: sheets say nothing of signals so near and so weak, and their own law, which the
/// sun flattens, would let a sensor see every wisp of haze. What the sensor's filter takes out
/// leaves the beam to what is behind it.
Return ReturnModel::from_air(double range, const EchoChance& chance) const {
  const auto soft = weather_.soft(range, chance.drop, chance.drop_position);
  if (!soft || soft->range < range_min_) return {};
  const double margin = soft->strength / detection_.least_strength();
  if (chance.detection >= air_kept_ * detection_.probability(margin)) return {};
  Return made;
  made.range = rounded(soft->range + range_sigma(soft->range, margin) * chance.normal);
  if (static_cast<double>(made.range) < range_min_) return {};
  const double seen = soft->strength * soft->range * soft->range;  // as reflectivity
  made.intensity = static_cast<float>(std::min(kBrightest, intensity_scale_ * seen));
  made.label = kFalseReturn;
  made.true_range = static_cast<float>(soft->range);
  made.strength = soft->strength;
  return made;
}

/// A false alarm.
Return ReturnModel::from_nothing(double place) const {
  Return made;
  made.range = rounded(range_min_ + (reach_ - range_min_) * place);
  made.true_range = made.range;
  made.label = kFalseReturn;
  return made;
}

/// Which of a beam's returns are reported: into the first of `returns`.
void ReturnModel::choose(std::span<Return> seen, std::span<Return> returns) const {
  if (seen.size() == 1) {
    returns[0] = seen[0];
    return;
  }
  const auto is_nearer = [](const Return& a, const Return& b) { return a.range < b.range; };
  if (mode_ == ReturnMode::kFirst) {
    returns[0] = *std::ranges::min_element(seen, is_nearer);
    return;
  }
  if (mode_ == ReturnMode::kLast) {
    returns[0] = *std::ranges::max_element(seen, is_nearer);
    return;
  }
  // the strongest first, of equals the nearest; a handful
  for (std::size_t i = 1; i < seen.size(); ++i) {
    for (std::size_t k = i; k > 0 && seen[k].strength > seen[k - 1].strength; --k) {
      std::swap(seen[k], seen[k - 1]);
    }
  }
  returns[0] = seen[0];
  if (mode_ == ReturnMode::kDual) {
    const auto last = std::ranges::max_element(seen, is_nearer);
    returns[1] = last == seen.begin() ? seen[1] : *last;
    return;
  }
  const std::size_t reported = std::min(seen.size(), most_returns(mode_));
  std::copy(seen.begin(), seen.begin() + static_cast<std::ptrdiff_t>(reported), returns.begin());
}

/// The signals of some beams that follow each other.
struct ReturnModel::Block {
  SignalBlock signals;
  std::size_t first = 0;                                  ///< Beam
  std::size_t beams = 0;                                  ///< How many.
  std::array<std::uint8_t, SignalBlock::kMost> counts{};  ///< Signals of each.
};

/// Reports what the beams of a block see by its measured signals. False alarms have none.
template <class Seen>
void ReturnModel::report(const Block& block,
                         const Seen& seen_by,
                         const BeamChances& chances,
                         std::span<Return> returns) const {
  const std::size_t most = most_returns(mode_);
  const bool is_clear = weather_.is_clear();
  std::array<Return, Echoes::kMost + 1> seen;
  std::size_t signal = 0;
  for (std::size_t i = 0; i < block.beams; ++i) {
    const std::size_t beam = block.first + i;
    std::size_t count = 0;
    for (std::size_t k = 0; k < block.counts[i]; ++k, ++signal) {
      const float measured = block.signals.measured[signal];
      if (measured < 0.0f || static_cast<double>(measured) < range_min_) continue;
      // of one echo in clear air there is nothing to choose
      Return& made = is_clear && block.counts[i] == 1 ? returns[beam * most] : seen[count++];
      take_surface(seen_by.echo(beam, k), block.signals.reflectivity[signal], measured, made);
    }
    if (!is_clear && !(chances.detection[beam] < false_alarm_)) {
      const double before =
          block.counts[i] == 0 ? reach_
                               : static_cast<double>(seen_by.echo(beam, block.counts[i] - 1).range);
      seen[count] = from_air(before, chances.more(beam, Echoes::kMost));
      count += seen[count].is_return() ? 1 : 0;
    }
    if (count > 0) choose(std::span(seen).first(count), returns.subspan(beam * most, most));
  }
}

template <class Seen>
void ReturnModel::measure_all(std::size_t count,
                              const Seen& seen_by,
                              const BeamChances& chances,
                              std::span<Return> returns) const {
  SignalFigures figures = detection_.figures();
  figures.range_sigma = noise_.range_sigma;
  figures.range_sigma_per_m2 = noise_.range_sigma_per_m2;
  figures.range_sigma_at_limit = noise_.range_sigma_at_limit;
  figures.range_step = noise_.range_step;
  const std::size_t most = most_returns(mode_);
  const bool is_clear = weather_.is_clear();
  Block block;
  SignalBlock& signals = block.signals;
  for (std::size_t i = 0; i < count;) {
    block.first = i;
    block.beams = 0;
    signals.count = 0;
    for (; i < count && block.beams < block.counts.size() &&
           signals.count + Echoes::kMost <= SignalBlock::kMost;
         ++i) {
      std::uint8_t& echoes = block.counts[block.beams++];
      echoes = 0;
      if (chances.detection[i] < false_alarm_) {
        returns[i * most] = from_nothing(chances.place[i]);
        continue;
      }
      seen_by.signals(i, [&](float range, float reflectivity) {
        const std::size_t at = signals.count++;
        signals.range[at] = static_cast<double>(range);
        const double left = is_clear ? 1.0 : weather_.left_after(signals.range[at]);
        signals.reflectivity[at] = static_cast<double>(reflectivity) * left;
        if (echoes == 0) {
          signals.normal[at] = chances.normal[i];
          signals.detection[at] = chances.detection[i];
        } else {
          const EchoChance chance = chances.more(i, echoes);
          signals.normal[at] = chance.normal;
          signals.detection[at] = chance.detection;
        }
        ++echoes;
      });
    }
    measure_signals(figures, signals);
    report(block, seen_by, chances, returns);
  }
}

namespace {

/// Beams that were traced to their echoes.
struct SeenEchoes {
  std::span<const Echoes> all;
  template <class Take>
  void signals(std::size_t beam, const Take& take) const {
    for (const Echo& echo : all[beam].span()) take(echo.range, echo.reflectivity);
  }
  [[nodiscard]] const Echo& echo(std::size_t beam, std::size_t k) const { return all[beam].all[k]; }
};

/// Beams that are lines.
struct SeenHits {
  std::span<const Hit> all;
  const ReturnModel& model;
  template <class Take>
  void signals(std::size_t beam, const Take& take) const {
    const Hit& hit = all[beam];
    if (hit.is_return()) take(hit.range, static_cast<float>(model.reflectivity(hit)));
  }
  [[nodiscard]] Echo echo(std::size_t beam, std::size_t /*k*/) const {
    return echo_with(all[beam], 0.0f);
  }
};

}  // namespace

void ReturnModel::measure(std::span<const Echoes> echoes,
                          const BeamChances& chances,
                          std::span<Return> returns) const {
  measure_all(echoes.size(), SeenEchoes{echoes}, chances, returns);
}

void ReturnModel::measure(std::span<const Hit> hits,
                          const BeamChances& chances,
                          std::span<Return> returns) const {
  measure_all(hits.size(), SeenHits{hits, *this}, chances, returns);
}

}  // namespace pointflight
