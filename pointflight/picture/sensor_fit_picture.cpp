#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/picture/plot.hpp"
#include "pointflight/picture/sensor_picture.hpp"

namespace pointflight::picture {
namespace {

constexpr int kFitWidth = 860;
constexpr int kFitHeight = 520;
constexpr double kFitTop = 104.0;
constexpr double kFitPlotHeight = 350.0;

/// By incidence: blue to red.
Color color_of(double incidence) {
  const double share = std::clamp(incidence / (80.0 * kDegree), 0.0, 1.0);
  return {0.1 + 0.75 * share, 0.35 - 0.1 * share, 0.75 - 0.55 * share};
}

std::vector<double> incidences_of(const SensorFit& fit) {
  std::vector<double> all;
  for (const NoiseBin& bin : fit.bins) {
    const bool known = std::any_of(
        all.begin(), all.end(), [&](double incidence) { return incidence == bin.incidence_from; });
    if (!known) all.push_back(bin.incidence_from);
  }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

void draw_sensor_fit(const SensorFit& fit, const std::string& title, const std::string& path) {
  Canvas canvas(kFitWidth, kFitHeight, kPaper);
  Plot plot{kLeftRoom + 10.0, kFitTop, kFitWidth - kLeftRoom - 40.0, kFitPlotHeight, {}, {}};
  double farthest = 1.0;
  double most = 1.0;  // mm
  for (const NoiseBin& bin : fit.bins) {
    farthest = std::max(farthest, bin.range);
    most = std::max(most, 1e3 * bin.sigma);
  }
  plot.x = {0.0, 1.05 * farthest, "range (m)"};
  plot.y = {0.0, 1.1 * most, "deviation of ranges from flat patches (mm)"};
  const double room = kFitWidth - 2.0 * kLeftRoom;
  canvas.text_within(kLeftRoom, 30.0, title, kTitleText, room, kInk);
  std::vector<LegendEntry> entries;
  for (const double incidence : incidences_of(fit)) {
    const Color color = color_of(incidence);
    double to = 0.0;
    std::vector<std::pair<double, double>> model;
    for (const NoiseBin& bin : fit.bins) {
      if (bin.incidence_from != incidence) continue;
      to = bin.incidence_to;
      const double size = 2.5 + std::min(3.5, 0.5 * std::log10(static_cast<double>(bin.points)));
      const auto [x, y] = plot.at(bin.range, 1e3 * bin.sigma);
      canvas.dot(x, y, size, color);
      model.push_back(plot.at(bin.range, 1e3 * bin.fitted));
    }
    canvas.begin_clip(plot.left, plot.top, plot.width, plot.height);
    canvas.line(model, 1.5, color, 0.7);
    canvas.end_clip();
    entries.push_back({fmt::format("{:.0f}° to {:.0f}°", incidence / kDegree, to / kDegree),
                       14.0,
                       [color](Canvas& c, double x, double y) { c.dot(x + 7.0, y, 4.5, color); }});
  }
  draw_legend(canvas, entries, kLeftRoom + 10.0, 52.0, room);
  canvas.text(kLeftRoom + 10.0,
              kFitTop - 14.0,
              "dots: patches seen at these incidences; lines: what the fitted figures give there",
              kTickText,
              kDim);
  draw_axes(canvas, plot);
  canvas.save(path);
}

}  // namespace pointflight::picture
