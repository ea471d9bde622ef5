#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pointflight/flight_log/log_comparison.hpp"
#include "pointflight/picture/canvas.hpp"
#include "pointflight/picture/pictures.hpp"
#include "pointflight/picture/plot.hpp"

namespace pointflight::picture {
namespace {

constexpr double kLogWidth = 560.0;  // of a panel's plot, pixels
constexpr double kLogHeight = 160.0;
constexpr double kLogGap = 62.0;
constexpr double kLogTop = 86.0;
constexpr double kLogLeft = kLeftRoom + 10.0;
constexpr double kDegrees = 57.29577951308232;
constexpr Color kLogged{0.0, 0.45, 0.70};
constexpr Color kFlownAgain{0.84, 0.37, 0.0};

/// One number of both, over time.
struct LogCurve {
  const char* label;
  double (*of)(const LoggedImu&);
};

constexpr LogCurve kLogCurves[] = {
    {"roll rate (deg/s)", [](const LoggedImu& i) { return kDegrees * i.gyro.x(); }},
    {"force ahead (m/s\u00b2)", [](const LoggedImu& i) { return i.accel.x(); }},
    {"pitch rate (deg/s)", [](const LoggedImu& i) { return kDegrees * i.gyro.y(); }},
    {"force left (m/s\u00b2)", [](const LoggedImu& i) { return i.accel.y(); }},
    {"yaw rate (deg/s)", [](const LoggedImu& i) { return kDegrees * i.gyro.z(); }},
    {"force up (m/s\u00b2)", [](const LoggedImu& i) { return i.accel.z(); }},
};

/// Samples that are drawn: a stretch in which single swings can be told apart.
std::span<const ComparedSample> drawn_samples(const LogComparison& comparison) {
  constexpr double kLongest = 12.0;  // s
  const std::span<const ComparedSample> all = comparison.samples;
  // the liveliest: most turning
  std::size_t best = 0;
  std::size_t best_count = all.size();
  double most = -1.0;
  for (std::size_t first = 0; first < all.size();) {
    std::size_t end = first;
    double turning = 0.0;
    while (end < all.size() && all[end].time < all[first].time + kLongest) {
      turning += all[end].logged.gyro.squaredNorm();
      ++end;
    }
    if (turning > most) {
      most = turning;
      best = first;
      best_count = end - first;
    }
    first = end;
  }
  return all.subspan(best, best_count);
}

void draw_log_panel(Canvas& canvas,
                    std::span<const ComparedSample> samples,
                    const LogCurve& curve,
                    double left,
                    double top) {
  double low = curve.of(samples.front().logged);
  double high = low;
  for (const ComparedSample& s : samples) {
    low = std::min({low, curve.of(s.logged), curve.of(s.flown)});
    high = std::max({high, curve.of(s.logged), curve.of(s.flown)});
  }
  const double room = std::max(0.05 * (high - low), 1e-3);
  const Plot plot{left,
                  top,
                  kLogWidth,
                  kLogHeight,
                  {samples.front().time, samples.back().time, "time of the log (s)"},
                  {low - room, high + room, curve.label}};
  canvas.begin_clip(plot.left, plot.top, plot.width, plot.height);
  std::vector<std::pair<double, double>> logged;
  std::vector<std::pair<double, double>> flown;
  double before = samples.front().time - 1.0;
  double in_window = 0.0;
  for (const ComparedSample& s : samples) {
    logged.push_back(plot.at(s.time, curve.of(s.logged)));
    // a new window begins where the log is: no line goes there
    if (s.in_window < in_window || s.time - before > 0.1) {
      if (flown.size() > 1) canvas.line(flown, 1.5, kFlownAgain);
      flown.clear();
    }
    flown.push_back(plot.at(s.time, curve.of(s.flown)));
    before = s.time;
    in_window = s.in_window;
  }
  canvas.line(logged, 1.2, kLogged, 0.8);
  if (flown.size() > 1) canvas.line(flown, 1.5, kFlownAgain);
  canvas.end_clip();
  draw_axes(canvas, plot);
}

}  // namespace

void draw_log_comparison(const FlightLog& log,
                         const VehicleSettings& vehicle,
                         const LogComparison& comparison,
                         double window,
                         const std::string& path) {
  const double column = kLogLeft + kLogWidth;
  constexpr int kRows = 3;
  Canvas canvas(static_cast<int>(2.0 * column + 24.0),
                static_cast<int>(kLogTop + kRows * (kLogHeight + kLogGap)),
                kPaper);
  const double room = 2.0 * column - kLogLeft;
  canvas.text_within(
      kLogLeft, 30.0, fmt::format("{} beside {}", vehicle.title, log.path), kTitleText, room, kInk);
  const auto stroke = [](double width, Color color) {
    return [=](Canvas& c, double x, double y) { c.line({{x, y}, {x + 24.0, y}}, width, color); };
  };
  draw_legend(
      canvas,
      {{"logged", 24.0, stroke(1.2, kLogged)},
       {fmt::format("flown by the logged outputs, {:g} s from where the log has it", window),
        24.0,
        stroke(1.5, kFlownAgain)}},
      kLogLeft,
      54.0,
      room);
  const auto samples = drawn_samples(comparison);
  for (std::size_t i = 0; i < std::size(kLogCurves); ++i) {
    const std::size_t row = i / 2;
    draw_log_panel(canvas,
                   samples,
                   kLogCurves[i],
                   kLogLeft + static_cast<double>(i % 2) * column,
                   kLogTop + static_cast<double>(row) * (kLogHeight + kLogGap));
  }
  canvas.save(path);
}

}  // namespace pointflight::picture
