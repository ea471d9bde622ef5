#include "pointflight/lidar/detection.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "pointflight/core/interpolation.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/lidar/internal/return_kernel.hpp"

namespace pointflight {
namespace {

constexpr Named<ReturnMode> kReturnModes[] = {{ReturnMode::kStrongest, "strongest"},
                                              {ReturnMode::kFirst, "first"},
                                              {ReturnMode::kLast, "last"},
                                              {ReturnMode::kDual, "dual"},
                                              {ReturnMode::kTriple, "triple"}};

constexpr double kPureGamma = 0.5;       // received power falls with the square of the range
constexpr double kLeastAlarm = 1e-9;     // T is finite
constexpr double kFurthestShare = 1e-3;  // probability that counts as none

/// Rated ranges of one level of light, in logarithms, by ascending reflectivity.
struct Level {
  std::vector<double> reflectivities, ranges;
  [[nodiscard]] double range_at(double reflectivity) const {
    return on_line(reflectivities, ranges, reflectivity);
  }
};

/// A lone range gets a second by the pure link budget.
Level level_of(const std::map<double, double>& rated) {
  Level level;
  for (const auto& [reflectivity, range] : rated) {
    level.reflectivities.push_back(math::log(reflectivity));
    level.ranges.push_back(math::log(range));
  }
  if (rated.size() == 1) {
    level.reflectivities.push_back(level.reflectivities[0] + 1.0);
    level.ranges.push_back(level.ranges[0] + kPureGamma);
  }
  return level;
}

}  // namespace

std::size_t most_returns(ReturnMode mode) {
  if (mode == ReturnMode::kDual) return 2;
  return mode == ReturnMode::kTriple ? 3 : 1;
}

std::span<const Named<ReturnMode>> return_modes() {
  return kReturnModes;
}

void describe(SettingsVisitor& v, DetectionSettings& s) {
  v.list({"rated", "", "ranges that the sheet states; none: all that a beam hits comes back"},
         s.rated,
         [](SettingsVisitor& w, RatedRange& rated) {
           w.value({"reflectivity", "", "of a diffuse target, face on", 1e-3, 1, true},
                   rated.reflectivity);
           w.value({"range", "m", "at which it comes back with `probability`", 0.01, 1e5, true},
                   rated.range);
           w.value({"sun_klx", "klx", "in such light", 0, 200}, rated.sun_klx);
         });
  v.value({"probability", "", "of a return at the rated ranges", 0.01, 0.999}, s.probability);
  v.value({"false_alarm", "", "share of beams that report what is not there", 0, 0.1},
          s.false_alarm);
  v.value({"air_filter",
           "",
           "share of returns of fog, dust and drops that the sensor itself tells from surfaces and "
           "takes out",
           0,
           1},
          s.air_filter);
  v.list({"near", "", "what is seen of signals from nearer than the receiver is made for"},
         s.near,
         [](SettingsVisitor& w, NearShare& near) {
           w.value({"range", "m", "ascending; straight lines between", 0, 1e3}, near.range);
           w.value({"share", "", "of the signal; all beyond the last range", 0.001, 1}, near.share);
         });
  v.value({"range_limit", "m", "nothing farther is reported, however bright; 0: no limit", 0, 1e5},
          s.range_limit);
  v.value({"intensity_at_100_percent",
           "",
           "reported of a diffuse target of 100 %, face on; 0: the map's own intensity",
           0,
           255},
          s.intensity_at_100_percent);
  v.choice({"returns", "", "which echoes of a beam are reported"}, s.returns, kReturnModes);
}

DetectionModel::DetectionModel(const DetectionSettings& settings, double sun_klx)
    : limit_(settings.range_limit) {
  threshold_ = -math::normal_quantile(std::max(settings.false_alarm, kLeastAlarm));
  slope_ = threshold_ + math::normal_quantile(settings.probability);
  for (const NearShare& near : settings.near) {
    near_ranges_.push_back(near.range);
    near_shares_.push_back(near.share);
  }
  std::map<double, std::map<double, double>> levels;
  for (const RatedRange& rated : settings.rated) {
    levels[rated.sun_klx][rated.reflectivity] = rated.range;
  }
  if (levels.empty()) return;
  // the two levels around, and the share of the brighter one
  auto brighter = levels.lower_bound(sun_klx);
  if (brighter == levels.end()) --brighter;
  const auto darker =
      brighter == levels.begin() || brighter->first <= sun_klx ? brighter : std::prev(brighter);
  const double share =
      brighter == darker ? 1.0 : (sun_klx - darker->first) / (brighter->first - darker->first);
  const Level bright = level_of(brighter->second);
  const Level dark = level_of(darker->second);
  log_reflectivities_ = bright.reflectivities;
  log_reflectivities_.insert(
      log_reflectivities_.end(), dark.reflectivities.begin(), dark.reflectivities.end());
  std::sort(log_reflectivities_.begin(), log_reflectivities_.end());
  log_reflectivities_.erase(std::unique(log_reflectivities_.begin(), log_reflectivities_.end()),
                            log_reflectivities_.end());
  for (const double place : log_reflectivities_) {
    log_ranges_.push_back(math::log(share * math::exp(bright.range_at(place)) +
                                    (1.0 - share) * math::exp(dark.range_at(place))));
  }
}

double DetectionModel::rated_range(double reflectivity) const {
  return math::exp(on_line(log_reflectivities_, log_ranges_, math::log(reflectivity)));
}

double DetectionModel::rated_reflectivity(double range) const {
  return math::exp(on_line(log_ranges_, log_reflectivities_, math::log(range)));
}

double DetectionModel::near_gain(double range) const {
  if (near_ranges_.empty() || range >= near_ranges_.back()) return 1.0;
  if (range <= near_ranges_.front()) return near_shares_.front();
  return on_line(near_ranges_, near_shares_, range);
}

double DetectionModel::margin_at(double probability) const {
  return (threshold_ + math::normal_quantile(probability)) / slope_;
}

double DetectionModel::margin(double reflectivity, double range) const {
  return reflectivity * near_gain(range) / rated_reflectivity(range);
}

double DetectionModel::probability(double margin) const {
  return math::normal_probability(slope_ * margin - threshold_);
}

double DetectionModel::least_strength() const {
  return math::exp(log_reflectivities_.front() - 2.0 * log_ranges_.front());
}

double DetectionModel::reach() const {
  const double reach = rated_range(1.0 / std::max(margin_at(kFurthestShare), 0.01));
  return limit_ > 0.0 ? std::min(limit_, reach) : reach;
}

SignalFigures DetectionModel::figures() const {
  return {.log_ranges = log_ranges_,
          .log_reflectivities = log_reflectivities_,
          .near_ranges = near_ranges_,
          .near_shares = near_shares_,
          .threshold = threshold_,
          .slope = slope_};
}

}  // namespace pointflight
