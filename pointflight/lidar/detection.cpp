#include "pointflight/lidar/detection.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "pointflight/core/math.hpp"

namespace pointflight {
namespace {

constexpr double kPureGamma = 0.5;       // received power falls with the square of the range
constexpr double kLeastAlarm = 1e-9;     // T is finite
constexpr double kFurthestShare = 1e-3;  // probability that counts as none

/// Ranges of one level of light, by log reflectivity.
using Curve = std::vector<std::pair<double, double>>;

/// Value at x of a line through points by ascending x, two at least; straight on beyond them.
double on_line(const Curve& points, double x) {
  const auto above =
      std::upper_bound(points.begin() + 1, points.end() - 1, x, [](double value, const auto& p) {
        return value < p.first;
      });
  const auto [x0, y0] = *(above - 1);
  const auto [x1, y1] = *above;
  return y0 + (y1 - y0) * (x - x0) / (x1 - x0);
}

/// One level's curve; a lone range gets a second by the pure link budget.
Curve curve_of(const std::map<double, double>& ranges) {
  Curve curve;
  for (const auto& [reflectivity, range] : ranges) {
    curve.emplace_back(math::log(reflectivity), math::log(range));
  }
  if (curve.size() == 1) {
    curve.emplace_back(curve[0].first + 1.0, curve[0].second + kPureGamma);
  }
  return curve;
}

}  // namespace

void describe(SettingsVisitor& v, DetectionSettings& s) {
  v.list({"rated", "", "ranges that the sheet states; none: all that a beam meets comes back"},
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
  v.value({"range_limit", "m", "nothing farther is reported, however bright; 0: no limit", 0, 1e5},
          s.range_limit);
  v.value({"intensity_at_100_percent",
           "",
           "reported of a diffuse target of 100 %, face on; 0: the map's own intensity",
           0,
           255},
          s.intensity_at_100_percent);
}

DetectionModel::DetectionModel(const DetectionSettings& settings, double sun_klx)
    : limit_(settings.range_limit) {
  threshold_ = -math::normal_quantile(std::max(settings.false_alarm, kLeastAlarm));
  slope_ = threshold_ + math::normal_quantile(settings.probability);
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
  const Curve bright = curve_of(brighter->second);
  const Curve dark = curve_of(darker->second);
  std::vector<double> places;
  for (const Curve* curve : {&bright, &dark}) {
    for (const auto& [place, range] : *curve) places.push_back(place);
  }
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  for (const double place : places) {
    const double range =
        share * math::exp(on_line(bright, place)) + (1.0 - share) * math::exp(on_line(dark, place));
    points_.push_back({place, math::log(range)});
  }
}

double DetectionModel::rated_range(double reflectivity) const {
  const double x = math::log(reflectivity);
  std::size_t i = 1;
  while (i + 1 < points_.size() && points_[i].log_reflectivity < x) ++i;
  const Point& a = points_[i - 1];
  const Point& b = points_[i];
  const double share = (x - a.log_reflectivity) / (b.log_reflectivity - a.log_reflectivity);
  return math::exp(a.log_range + share * (b.log_range - a.log_range));
}

double DetectionModel::rated_reflectivity(double range) const {
  const double y = math::log(range);
  std::size_t i = 1;
  while (i + 1 < points_.size() && points_[i].log_range < y) ++i;
  const Point& a = points_[i - 1];
  const Point& b = points_[i];
  const double share = (y - a.log_range) / (b.log_range - a.log_range);
  return math::exp(a.log_reflectivity + share * (b.log_reflectivity - a.log_reflectivity));
}

double DetectionModel::margin(double reflectivity, double range) const {
  return reflectivity / rated_reflectivity(range);
}

double DetectionModel::probability(double margin) const {
  return math::normal_probability(slope_ * margin - threshold_);
}

double DetectionModel::least_strength() const {
  return math::exp(points_.front().log_reflectivity - 2.0 * points_.front().log_range);
}

double DetectionModel::reach() const {
  const double least = (threshold_ + math::normal_quantile(kFurthestShare)) / slope_;
  const double reach = rated_range(1.0 / std::max(least, 0.01));
  return limit_ > 0.0 ? std::min(limit_, reach) : reach;
}

}  // namespace pointflight
