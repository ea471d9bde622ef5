#include "pointflight/picture/sensor_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pointflight/picture/plot.hpp"

namespace pointflight::picture {
namespace {

constexpr int kComparisonWidth = 1180;
constexpr int kComparisonHeight = 500;
constexpr double kPlotTop = 84.0;
constexpr double kPlotHeight = 350.0;
constexpr double kLegendMiddle = 60.0;
constexpr double kMarkLength = 22.0;
constexpr Color kReal{0.15, 0.15, 0.18};
constexpr Color kModelled{0.85, 0.37, 0.1};
constexpr Color kPlain{0.62, 0.7, 0.82};

using Points = std::vector<std::pair<double, double>>;

/// Incidences that are drawn apart.
struct IncidenceClass {
  std::size_t from, to;  ///< Bins.
  Color color;
  std::string words;
};

std::vector<IncidenceClass> incidence_classes() {
  return {{0, 1, {0.12, 0.35, 0.65}, "incidence below 30°"},
          {2, 3, {0.1, 0.6, 0.35}, "45° to 60°"},
          {4, 7, {0.75, 0.2, 0.45}, "70° to 85°"}};
}

double middle_of(std::size_t range) {
  return 0.5 * (SensorComparison::kRanges[range] + SensorComparison::kRanges[range + 1]);
}

/// Of a class of incidences by range; nothing if too few beams tell.
Points shares_of(const SensorComparison& comparison,
                 const IncidenceClass& of,
                 double Sides::*side,
                 const Plot& plot) {
  Points points;
  for (std::size_t r = 0; r < comparison.shares.size(); ++r) {
    double beams = 0.0;
    double returns = 0.0;
    for (std::size_t i = of.from; i < of.to; ++i) {
      beams += comparison.shares[r][i].beams;
      returns += comparison.shares[r][i].returns.*side;
    }
    if (beams < SensorComparison::kLeastBeams || middle_of(r) > plot.x.to) continue;
    points.push_back(plot.at(middle_of(r), std::min(100.0, 100.0 * returns / beams)));
  }
  return points;
}

LegendEntry line_entry(const std::string& words, Color color, double width, bool has_dot) {
  return {words, kMarkLength, [=](Canvas& canvas, double x, double y) {
            canvas.line({{x, y}, {x + kMarkLength, y}}, width, color);
            if (has_dot) canvas.dot(x + 0.5 * kMarkLength, y, 4.0, color);
          }};
}

void draw_shares(Canvas& canvas, const SensorComparison& comparison) {
  Plot plot{kLeftRoom + 10.0, kPlotTop, 460.0, kPlotHeight, {}, {}};
  double farthest = 10.0;
  for (std::size_t r = 0; r < comparison.shares.size(); ++r) {
    for (const ReturnShare& share : comparison.shares[r]) {
      if (SensorComparison::counts(share)) farthest = SensorComparison::kRanges[r + 1];
    }
  }
  plot.x = {0.0, farthest, "range (m)"};
  plot.y = {0.0, 100.0, "beams that come back (%)"};
  draw_axes(canvas, plot);
  std::vector<LegendEntry> entries;
  for (const IncidenceClass& of : incidence_classes()) {
    const Points real = shares_of(comparison, of, &Sides::real, plot);
    if (real.empty()) continue;
    canvas.line(real, 1.0, of.color, 0.6);
    for (const auto& [x, y] : real) canvas.dot(x, y, 4.0, of.color);
    canvas.line(shares_of(comparison, of, &Sides::modelled, plot), 2.5, of.color);
    entries.push_back(line_entry(of.words, of.color, 2.5, false));
  }
  entries.push_back(line_entry("dots: real", kReal, 1.0, true));
  entries.push_back(line_entry("thick: by the model", kReal, 2.5, false));
  draw_legend(canvas, entries, plot.left, kLegendMiddle - kLegendRow, plot.width);
}

/// Lines across the plot at whole steps of y, and what y is.
void draw_percent_axis(Canvas& canvas, const Plot& plot) {
  for (double y : ticks(0.0, plot.y.to, tick_step(plot.y.to, 7))) {
    const double at = plot.at(0.0, y).second;
    canvas.line({{plot.left, at}, {plot.right(), at}}, 0.7, kDim, 0.5);
    canvas.text(plot.left - 8.0,
                at + 4.0,
                fmt::format("{:.0f}", std::abs(y)),
                kTickText,
                kInk,
                Align::kRight);
  }
  canvas.text_upwards(
      plot.left - 42.0, plot.top + 0.5 * plot.height, plot.y.label, kLabelText, kInk);
}

void draw_edges(Canvas& canvas, const SensorComparison& comparison) {
  constexpr std::size_t kBins = std::tuple_size_v<decltype(SensorComparison::edges)>;
  Sides all;
  for (const Sides& bin : comparison.edges) {
    all.real += bin.real;
    all.modelled += bin.modelled;
    all.plain += bin.plain;
  }
  constexpr std::array<double Sides::*, 3> kSides = {&Sides::plain, &Sides::modelled, &Sides::real};
  constexpr std::array<Color, 3> kColors = {kPlain, kModelled, kReal};
  Plot plot{640.0 + kLeftRoom, kPlotTop, 440.0, kPlotHeight, {}, {}};
  double highest = 5.0;
  for (const Sides& bin : comparison.edges) {
    for (const auto side : kSides) {
      if (all.*side > 0.0) highest = std::max(highest, 100.0 * bin.*side / (all.*side));
    }
  }
  plot.y = {0.0, 1.05 * highest, "returns at edges (%)"};
  plot.x = {0.0, static_cast<double>(kBins), ""};
  const double wide = plot.width / static_cast<double>(kBins);
  draw_percent_axis(canvas, plot);
  for (std::size_t b = 0; b < kBins; ++b) {
    const Sides& bin = comparison.edges[b];
    for (std::size_t s = 0; s < kSides.size(); ++s) {
      if (all.*kSides[s] <= 0.0) continue;
      const double share = 100.0 * bin.*kSides[s] / (all.*kSides[s]);
      const double top = plot.at(0.0, share).second;
      canvas.box(plot.left + wide * (static_cast<double>(b) + 0.08 + 0.28 * static_cast<double>(s)),
                 top,
                 0.28 * wide,
                 plot.bottom() - top,
                 kColors[s]);
    }
    if (b + 1 == kBins) break;
    const double limit = SensorComparison::kErrors[b];
    if (std::abs(limit) < 0.15 && std::abs(limit) > 0.03) continue;  // no room for all of them
    canvas.text(plot.left + wide * static_cast<double>(b + 1),
                plot.bottom() + 15.0,
                fmt::format("{:g}", limit),
                0.8 * kTickText,
                kInk,
                Align::kCenter);
  }
  canvas.line({{plot.left, plot.bottom()}, {plot.right(), plot.bottom()}}, 1.0, kInk);
  canvas.text(plot.left + 0.5 * plot.width,
              plot.bottom() + 34.0,
              "measured range minus that of a line along the beam (m)",
              kLabelText,
              kInk,
              Align::kCenter);
  const auto block = [](const char* words, Color color) {
    return LegendEntry{words, 14.0, [color](Canvas& on, double x, double y) {
                         on.box(x, y - 6.0, 12.0, 12.0, color);
                       }};
  };
  draw_legend(canvas,
              {block("real", kReal), block("by the model", kModelled), block("lines", kPlain)},
              plot.left,
              kLegendMiddle,
              plot.width);
}

}  // namespace

void draw_sensor_comparison(const SensorComparison& comparison,
                            const std::string& title,
                            const std::string& path) {
  Canvas canvas(kComparisonWidth, kComparisonHeight, kPaper);
  canvas.text_within(kLeftRoom + 10.0, 26.0, title, kTitleText, kComparisonWidth - 90.0, kInk);
  draw_shares(canvas, comparison);
  draw_edges(canvas, comparison);
  canvas.save(path);
}

}  // namespace pointflight::picture
