#include "pointflight/picture/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace pointflight::picture {
namespace {

constexpr Color kFrame{0.35, 0.35, 0.4};
constexpr double kTickLength = 5.0;

/// Calls `place(entry, x, row)` for each entry: rows break when the width is used up.
template <class Place>
void lay_out_legend(const Canvas& canvas,
                    const std::vector<LegendEntry>& entries,
                    double width,
                    const Place& place) {
  constexpr double kApart = 18.0;
  double x = 0.0;
  int row = 0;
  for (const LegendEntry& entry : entries) {
    const double wide = entry.mark_width + 6.0 + canvas.text_width(entry.words, kLabelText);
    if (x > 0.0 && x + wide > width) {
      x = 0.0;
      ++row;
    }
    place(entry, x, row);
    x += wide + kApart;
  }
}

/// Round numbers of a bar: on a logarithmic one 1, 2 and 5 of each decade.
std::vector<double> bar_ticks(const ColorBar& bar, double height) {
  if (!bar.logarithmic) {
    const int most = std::max(2, static_cast<int>(height / 38.0));
    return ticks(bar.low, bar.high, tick_step(bar.high - bar.low, most));
  }
  std::vector<double> values;
  for (double decade = std::pow(10.0, std::floor(std::log10(bar.low))); decade <= bar.high;
       decade *= 10.0) {
    for (const double digit : {1.0, 2.0, 5.0}) {
      const double value = decade * digit;
      if (value >= bar.low * 0.999 && value <= bar.high * 1.001) values.push_back(value);
    }
  }
  return values;
}

}  // namespace

double tick_step(double span, int most, Steps steps) {
  if (!(span > 0.0)) return 1.0;
  if (steps == Steps::kAngle) {
    for (const double step : {1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 90.0}) {
      if (span >= 4.0 && span / step <= most) return step;
    }
  }
  const double decade = std::pow(10.0, std::floor(std::log10(span / most)));
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (span / (digit * decade) <= most * (1.0 + 1e-9)) return digit * decade;
  }
  return 10.0 * decade;
}

std::vector<double> ticks(double low, double high, double step) {
  std::vector<double> values;
  const double slack = 1e-9 * (high - low);
  for (double n = std::ceil((low - slack) / step); n * step <= high + slack; n += 1.0) {
    values.push_back(n * step);
  }
  return values;
}

std::string tick_text(double value, double step) {
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 9);
  if (std::abs(value) < 0.5 * step) value = 0.0;
  return fmt::format("{:.{}f}", value, decimals);
}

void draw_axes(Canvas& canvas, const Plot& plot) {
  canvas.outline(plot.left, plot.top, plot.width, plot.height, 1.0, kFrame);
  const auto low = [](const Axis& axis) { return std::min(axis.from, axis.to); };
  const auto high = [](const Axis& axis) { return std::max(axis.from, axis.to); };
  const double x_step = tick_step(
      high(plot.x) - low(plot.x), std::max(1, static_cast<int>(plot.width / 60.0)), plot.x.steps);
  for (const double value : ticks(low(plot.x), high(plot.x), x_step)) {
    const double x = plot.at(value, plot.y.from).first;
    canvas.line({{x, plot.bottom()}, {x, plot.bottom() + kTickLength}}, 1.0, kFrame);
    canvas.text(x, plot.bottom() + 18.0, tick_text(value, x_step), kTickText, kInk, Align::kCenter);
  }
  const double y_step = tick_step(
      high(plot.y) - low(plot.y), std::max(1, static_cast<int>(plot.height / 30.0)), plot.y.steps);
  for (const double value : ticks(low(plot.y), high(plot.y), y_step)) {
    const double y = plot.at(plot.x.from, value).second;
    canvas.line({{plot.left - kTickLength, y}, {plot.left, y}}, 1.0, kFrame);
    canvas.text(plot.left - 8.0, y + 4.0, tick_text(value, y_step), kTickText, kInk, Align::kRight);
  }
  canvas.text(plot.left + 0.5 * plot.width,
              plot.bottom() + 35.0,
              plot.x.label,
              kLabelText,
              kInk,
              Align::kCenter);
  canvas.text_upwards(
      plot.left - kLeftRoom + 14.0, plot.top + 0.5 * plot.height, plot.y.label, kLabelText, kInk);
}

void draw_color_bar(Canvas& canvas, const ColorBar& bar, double left, double top, double height) {
  constexpr double kWidth = 14.0;
  const int rows = std::max(2, static_cast<int>(height));
  for (int i = 0; i < rows; ++i) {
    canvas.box(left,
               top + height * (1.0 - static_cast<double>(i + 1) / rows),
               kWidth,
               height / rows + 1.0,
               bar.color((i + 0.5) / rows));
  }
  canvas.outline(left, top, kWidth, height, 1.0, kFrame);
  const auto values = bar_ticks(bar, height);
  const double step = values.size() > 1 ? values[1] - values[0] : 1.0;
  for (const double value : values) {
    const double share = bar.logarithmic ? std::log(value / bar.low) / std::log(bar.high / bar.low)
                                         : (value - bar.low) / (bar.high - bar.low);
    const double y = top + height * (1.0 - share);
    canvas.line({{left + kWidth, y}, {left + kWidth + 4.0, y}}, 1.0, kFrame);
    canvas.text(left + kWidth + 7.0,
                y + 4.0,
                bar.logarithmic ? fmt::format("{:g}", value) : tick_text(value, step),
                kTickText,
                kInk);
  }
  canvas.text_upwards(left + kWidth + 54.0, top + 0.5 * height, bar.label, kLabelText, kInk);
}

int legend_rows(const std::vector<LegendEntry>& entries, double width) {
  const Canvas scratch(1, 1, kPaper);
  int rows = 0;
  lay_out_legend(
      scratch, entries, width, [&](const LegendEntry&, double, int row) { rows = row + 1; });
  return rows;
}

void draw_legend(
    Canvas& canvas, const std::vector<LegendEntry>& entries, double left, double y, double width) {
  lay_out_legend(canvas, entries, width, [&](const LegendEntry& entry, double x, int row) {
    const double middle = y + kLegendRow * row;
    entry.mark(canvas, left + x, middle);
    canvas.text(left + x + entry.mark_width + 6.0, middle + 4.5, entry.words, kLabelText, kInk);
  });
}

}  // namespace pointflight::picture
