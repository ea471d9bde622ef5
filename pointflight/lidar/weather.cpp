#include "pointflight/lidar/weather.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"

namespace pointflight {
namespace {

constexpr Named<WeatherKind> kKinds[] = {{WeatherKind::kClear, "clear"},
                                         {WeatherKind::kFog, "fog"},
                                         {WeatherKind::kDust, "dust"},
                                         {WeatherKind::kRain, "rain"},
                                         {WeatherKind::kSnow, "snow"}};

constexpr double kOverlapBegins = 0.9;   // m
constexpr double kOverlapEnds = 1.0;     // m
constexpr double kFogStep = 0.05;        // m
constexpr double kFogReach = 60.0;       // m: the peak lies within the first metres
constexpr double kPeak = 0.5;            // of the strongest: how wide a peak counts
constexpr double kBackscatter = 0.046;   // beta times the visibility, 1/sr
constexpr double kLeastDrop = 0.05;      // mm
constexpr double kRainIndex = 1.328;     // refractive, of water at 905 nm
constexpr double kSnowIndex = 1.3031;    // of ice
constexpr std::size_t kDropCells = 48;   // along a beam
constexpr double kDropReach = 100.0;     // m: farther ones are too weak to be seen
constexpr std::size_t kStrengths = 128;  // of signals, in the table
constexpr double kStrengthSpan = 1e9;    // from the strongest to the weakest of them

double squared(double x) {
  return x * x;
}

/// Share of the beam that the receiver sees.
double overlap(double range) {
  return std::clamp((range - kOverlapBegins) / (kOverlapEnds - kOverlapBegins), 0.0, 1.0);
}

}  // namespace

void describe(SettingsVisitor& v, WeatherSettings& s) {
  v.choice({"kind", "", "what is in the air"}, s.kind, kKinds);
  v.only_if(s.kind == WeatherKind::kFog || s.kind == WeatherKind::kDust,
            "kind: fog or dust",
            [&](SettingsVisitor& w) {
              w.value({"visibility", "m", "where 5 % of light is left", 5, 1e5}, s.visibility);
            });
  v.only_if(s.kind == WeatherKind::kRain || s.kind == WeatherKind::kSnow,
            "kind: rain or snow",
            [&](SettingsVisitor& w) {
              w.value({"rate", "mm/h", "of water", 0.1, 200}, s.rate);
            });
}

Weather::Weather(
    const WeatherSettings& settings, double divergence, double pulse, double nearest, double reach)
    : kind_(settings.kind), divergence_(divergence) {
  if (kind_ == WeatherKind::kFog || kind_ == WeatherKind::kDust) {
    set_up_fog(settings.visibility, pulse, nearest, reach);
  } else if (kind_ != WeatherKind::kClear) {
    set_up_drops(settings.rate, divergence, nearest, reach);
  }
}

double Weather::left_after(double range) const {
  return math::exp(-2.0 * extinction_ * range);
}

double Weather::target(double reflectivity, double range) const {
  return reflectivity * left_after(range) / squared(range);
}

void Weather::set_up_fog(double visibility, double pulse, double nearest, double reach) {
  extinction_ = math::log(20.0) / visibility;
  const double beta = kBackscatter / visibility;
  const double length = kLightSpeed * pulse;  // of c t / 2 over 2 tau
  const auto steps = static_cast<std::size_t>(std::min(reach, kFogReach) / kFogStep);
  constexpr int kParts = 120;
  for (std::size_t i = 0; i <= steps; ++i) {
    const double range = kFogStep * static_cast<double>(i);
    double sum = 0.0;
    for (int k = 0; k < kParts && range >= nearest; ++k) {
      const double back = (k + 0.5) / kParts;  // share of the pulse
      const double r = range - back * length;
      if (r <= kOverlapBegins) break;
      const double shape = squared(math::sincos(kPi * back).sin);
      sum += shape * left_after(r) * overlap(r) / squared(r) * length / kParts;
    }
    signal_.push_back(kPi * beta * sum);
    const bool first = i == 0 || signal_[i] > signal_[best_.back()];
    best_.push_back(first ? i : best_.back());
  }
}

std::optional<Weather::Soft> Weather::fog_before(double range, double first) const {
  const auto last = std::min(signal_.size() - 1, static_cast<std::size_t>(range / kFogStep));
  const std::size_t best = best_[last];
  if (signal_[best] <= 0.0) return std::nullopt;
  // anywhere within the peak: droplets are not spread evenly
  std::size_t begin = best;
  while (begin > 0 && signal_[begin - 1] > kPeak * signal_[best]) --begin;
  std::size_t end = best + 1;
  while (end <= last && signal_[end] > kPeak * signal_[best]) ++end;
  const double place = static_cast<double>(begin) + first * static_cast<double>(end - begin);
  return Soft{std::min(range, kFogStep * place), signal_[best]};
}

void Weather::set_up_drops(double rate, double divergence, double nearest, double reach) {
  const bool rain = kind_ == WeatherKind::kRain;
  const double log_rate = math::log(rate);
  const auto power = [&](double exponent) { return math::exp(exponent * log_rate); };
  drops_ = rain ? 8000.0 : 7600.0 * power(-0.87);
  steepness_ = rain ? 4.1 * power(-0.21) : 2.55 * power(-0.48);
  const double index = rain ? kRainIndex : kSnowIndex;
  fresnel_ = squared((index - 1.0) / (index + 1.0));
  extinction_ = 1e-6 * kPi * drops_ / (steepness_ * steepness_ * steepness_);
  // evenly in the logarithm of the range: near drops are the strong ones
  const double begin = std::max(nearest, kOverlapBegins);
  const double ratio = std::min(reach, kDropReach) / begin;
  if (ratio <= 1.0) return;
  const double step = math::exp(math::log(ratio) / static_cast<double>(kDropCells));
  double near = begin;
  for (std::size_t i = 0; i < kDropCells; ++i) {
    const double far = near * step;
    // of a cone: (pi / 3) r (divergence r / 2)^2 up to r
    const double volume =
        kPi / 3.0 * squared(0.5 * divergence) * (far * far * far - near * near * near);
    cells_.push_back({0.5 * (near + far), volume});
    near = far;
  }
  tabulate_drops();
}

/// Expected number of drops of a cell that are stronger.
double Weather::drops_in(std::size_t cell, double strength) const {
  const auto& [range, volume] = cells_[cell];
  const double full = fresnel_ * left_after(range) / squared(range);  // of one as wide as the beam
  if (strength >= full) return 0.0;
  const double beam = 1e3 * divergence_ * range;  // mm
  const double least = std::max(kLeastDrop, beam * std::sqrt(strength / full));
  return volume * drops_ / steepness_ * math::exp(-steepness_ * least);
}

/// Expected numbers of stronger drops, for strengths evenly in the logarithm.
void Weather::tabulate_drops() {
  const double strongest = fresnel_ / squared(cells_.front().range);
  const double step = math::exp(-math::log(kStrengthSpan) / static_cast<double>(kStrengths - 1));
  double strength = strongest;
  for (std::size_t i = 0; i < kStrengths; ++i) {
    strengths_.push_back(strength);
    double sum = 0.0;
    stronger_.push_back(sum);
    for (std::size_t k = 0; k < cells_.size(); ++k) {
      sum += drops_in(k, strength);
      stronger_.push_back(sum);
    }
    strength *= step;
  }
}

/// Drops lie at random: none is stronger than s with probability e^-Lambda(s), Lambda the expected
/// number of stronger ones. So the strongest is where Lambda(s) = -ln u; which cell it lies in goes
/// by what each adds there.
std::optional<Weather::Soft> Weather::drop_before(double range, double first, double second) const {
  const auto cells = static_cast<std::size_t>(
      std::lower_bound(cells_.begin(),
                       cells_.end(),
                       range,
                       [](const Cell& cell, double r) { return cell.range < r; }) -
      cells_.begin());
  const std::size_t stride = cells_.size() + 1;
  const auto stronger = [&](std::size_t i, std::size_t k) { return stronger_[i * stride + k]; };
  const double wanted = -math::log(std::max(first, 1e-12));
  if (stronger(kStrengths - 1, cells) <= wanted) return std::nullopt;  // none that matters
  std::size_t above = 0;  // a strength that fewer are stronger than
  std::size_t below = kStrengths - 1;
  while (below - above > 1) {
    const std::size_t middle = (above + below) / 2;
    (stronger(middle, cells) > wanted ? below : above) = middle;
  }
  const double gained = stronger(below, cells) - stronger(above, cells);
  const double share = gained > 0.0 ? (wanted - stronger(above, cells)) / gained : 0.0;
  const double strength = strengths_[above] + share * (strengths_[below] - strengths_[above]);
  const double place = second * gained;
  std::size_t cell = 0;
  while (cell + 1 < cells && stronger(below, cell + 1) - stronger(above, cell + 1) <= place) ++cell;
  return Soft{cells_[cell].range, strength};
}

std::optional<Weather::Soft> Weather::soft(double range, double first, double second) const {
  if (!signal_.empty()) return fog_before(range, first);
  return cells_.empty() ? std::nullopt : drop_before(range, first, second);
}

}  // namespace pointflight
