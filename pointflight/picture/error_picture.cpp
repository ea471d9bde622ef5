#include "pointflight/picture/error_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/fidelity/error_statistics.hpp"
#include "pointflight/picture/canvas.hpp"
#include "pointflight/picture/plot.hpp"

namespace pointflight::picture {
namespace {

constexpr double kLeft = kLeftRoom + 6.0;
constexpr double kRightMargin = 24.0;
constexpr double kHeader = 74.0;
constexpr double kPanelWidth = 640.0;
constexpr double kCaption = 26.0;

struct Kind {
  const char* name;
  Color color;
};
enum : std::size_t { kRight, kEarly, kLate, kMissing, kFalse, kNothing };
constexpr std::array<Kind, 6> kKinds = {
    {{"right (light: exact, dark: off by up to 0.1 m)", {0.75, 0.75, 0.75}},
     {"early", {1.0, 0.2, 0.2}},
     {"late", {0.25, 0.45, 1.0}},
     {"missing", {0.1, 0.9, 0.9}},
     {"false return", {1.0, 0.65, 0.1}},
     {"", {0.2, 0.2, 0.25}}}};

std::size_t kind_of(const ErrorMark& mark) {
  if (mark.truth < 0.0f) return mark.rendered < 0.0f ? kNothing : kFalse;
  if (mark.rendered < 0.0f) return kMissing;
  const double error = static_cast<double>(mark.rendered - mark.truth);
  if (error < -ErrorStatistics::kRight) return kEarly;
  return error > ErrorStatistics::kRight ? kLate : kRight;
}

Color color_of(const ErrorMark& mark) {
  const std::size_t kind = kind_of(mark);
  if (kind != kRight) return kKinds[kind].color;
  const double size = std::abs(static_cast<double>(mark.rendered - mark.truth));
  const double grey = 0.85 - 0.6 * std::min(1.0, size / ErrorStatistics::kRight);
  return {grey, grey, grey};
}

/// Azimuth and elevation of a panel's rays, degrees; left is +azimuth, as the sensor sees it.
Plot plot_of(const ErrorPanel& panel) {
  constexpr double kLeast = 90.0;  // pixels high
  double az_low = 180.0;
  double az_high = -180.0;
  double el_low = 90.0;
  double el_high = -90.0;
  for (const ErrorMark& m : panel.marks) {
    az_low = std::min(az_low, static_cast<double>(m.azimuth) / kDegree);
    az_high = std::max(az_high, static_cast<double>(m.azimuth) / kDegree);
    el_low = std::min(el_low, static_cast<double>(m.elevation) / kDegree);
    el_high = std::max(el_high, static_cast<double>(m.elevation) / kDegree);
  }
  if (az_high - az_low < 1.0) {  // a degree at least, whatever there is
    az_low = panel.marks.empty() ? 0.0 : az_low;
    az_high = az_low + 1.0;
  }
  if (el_high - el_low < 1.0) {
    el_low = panel.marks.empty() ? 0.0 : el_low;
    el_high = el_low + 1.0;
  }
  return {0.0,
          0.0,
          kPanelWidth,
          std::max(kLeast, kPanelWidth / (az_high - az_low) * (el_high - el_low)),
          {az_high, az_low, "azimuth (deg)", Steps::kAngle},
          {el_low, el_high, "elevation (deg)", Steps::kAngle}};
}

void draw_panel(Canvas& canvas, const ErrorPanel& panel, const Plot& plot) {
  canvas.text(plot.left, plot.top - 7.0, panel.title, kLabelText, kInk);
  canvas.box(plot.left, plot.top, plot.width, plot.height, kNight);
  const double area = plot.width * plot.height;
  const double apart =
      std::sqrt(area / static_cast<double>(std::max<std::size_t>(1, panel.marks.size())));
  const int side = std::clamp(static_cast<int>(std::ceil(apart)), 1, 4);
  canvas.begin_pixels();
  // errors over what is right
  for (const bool wrong : {false, true}) {
    for (const ErrorMark& m : panel.marks) {
      const std::size_t kind = kind_of(m);
      if ((kind != kRight && kind != kNothing) != wrong) continue;
      const auto [px, py] = plot.at(static_cast<double>(m.azimuth) / kDegree,
                                    static_cast<double>(m.elevation) / kDegree);
      // whole marks, inside the frame
      const int x = std::min(static_cast<int>(px), static_cast<int>(plot.right()) - side);
      const int y = std::min(static_cast<int>(py), static_cast<int>(plot.bottom()) - side);
      for (int i = 0; i < side; ++i) {
        for (int j = 0; j < side; ++j) canvas.put(x + i, y + j, color_of(m), 1.0);
      }
    }
  }
  canvas.end_pixels();
  draw_axes(canvas, plot);
}

/// Kinds of error with their shares of all rays.
std::vector<LegendEntry> legend_of(const std::array<std::size_t, kKinds.size()>& counts) {
  std::size_t rays = 0;
  for (const std::size_t count : counts) rays += count;
  std::vector<LegendEntry> entries;
  for (std::size_t kind = 0; kind < kNothing; ++kind) {
    const double percent = 100.0 * static_cast<double>(counts[kind]) /
                           static_cast<double>(std::max<std::size_t>(1, rays));
    entries.push_back({fmt::format("{} {:.2f} %", kKinds[kind].name, percent),
                       12.0,
                       [kind](Canvas& canvas, double x, double y) {
                         canvas.box(x, y - 6.0, 12.0, 12.0, kKinds[kind].color);
                       }});
  }
  return entries;
}

}  // namespace

void draw_errors(std::span<const ErrorPanel> panels,
                 const std::string& title,
                 const std::string& path) {
  const std::size_t columns = panels.size() > 1 ? 2 : 1;
  double tallest = 0.0;
  std::array<std::size_t, kKinds.size()> counts{};
  for (const ErrorPanel& panel : panels) {
    tallest = std::max(tallest, plot_of(panel).height);
    for (const ErrorMark& m : panel.marks) ++counts[kind_of(m)];
  }
  const std::size_t rows = (panels.size() + columns - 1) / columns;
  const double column_width = kLeft + kPanelWidth;
  const double row_height = kCaption + tallest + kBottomRoom + 8.0;
  const auto entries = legend_of(counts);
  const double width = static_cast<double>(columns) * column_width + kRightMargin;
  const double room = width - kLeft - kRightMargin;
  const double header = kHeader + kLegendRow * (legend_rows(entries, room) - 1);
  Canvas canvas(static_cast<int>(width),
                static_cast<int>(header + static_cast<double>(rows) * row_height + 8.0),
                kPaper);
  canvas.text_within(kLeft, 28.0, title, kTitleText, room, kInk);
  draw_legend(canvas, entries, kLeft, 52.0, room);
  for (std::size_t i = 0; i < panels.size(); ++i) {
    Plot plot = plot_of(panels[i]);
    plot.left = kLeft + static_cast<double>(i % columns) * column_width;
    const std::size_t row = i / columns;
    plot.top = header + kCaption + static_cast<double>(row) * row_height;
    draw_panel(canvas, panels[i], plot);
  }
  canvas.save(path);
}

}  // namespace pointflight::picture
