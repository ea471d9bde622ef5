#include "apps/campaign_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/picture/pictures.hpp"
#include "pointflight/picture/plot.hpp"

namespace pointflight::apps {
namespace {

constexpr double kRatesWidth = 520.0;  // of a panel's plot, pixels
constexpr double kRatesHeight = 190.0;
constexpr double kRatesTop = 76.0;
constexpr double kRatesGap = 74.0;
constexpr double kRatesMargin = 24.0;
constexpr std::size_t kMostPlotLines = 8;

using Runs = std::vector<const RunRecord*>;

/// A combination of the other axes' values, with its runs by the axis's value.
struct Line {
  std::string name;
  std::map<double, Runs> by_value;
};

std::vector<Line> lines_over(const Plan& plan, const std::vector<Runs>& points, std::size_t axis) {
  std::vector<Line> lines;
  for (std::size_t point = 0; point < points.size(); ++point) {
    const std::vector<std::string>& values = plan.point_values[point];
    double x = 0.0;
    if (!parse_number(values[axis], x)) return {};
    std::string name;
    for (std::size_t i = 0; i < plan.grid_keys; ++i) {
      if (i == axis) continue;
      name += fmt::format("{}{} {}", name.empty() ? "" : ", ", plan.keys[i], values[i]);
    }
    auto found = std::find_if(
        lines.begin(), lines.end(), [&](const Line& line) { return line.name == name; });
    if (found == lines.end()) found = lines.insert(lines.end(), Line{name, {}});
    found->by_value[x] = points[point];
  }
  return lines;
}

/// A value with its interval, if there is one.
struct Estimate {
  double value, low, high;
};
using Estimator = std::function<std::optional<Estimate>(const Runs&)>;

Estimator rate(Counted counted) {
  return [counted](const Runs& runs) -> std::optional<Estimate> {
    const Rate r = rate_of(runs, counted);
    if (r.of == 0) return std::nullopt;
    return Estimate{100.0 * r.value, 100.0 * r.low, 100.0 * r.high};
  };
}

std::optional<Estimate> closest_approach(const Runs& runs) {
  const Spread spread = spread_of(runs, "closest_approach");
  if (spread.count == 0) return std::nullopt;
  return Estimate{spread.median, spread.p05, spread.p95};
}

void draw_estimates(picture::Canvas& canvas,
                    const picture::Plot& plot,
                    const std::vector<Line>& lines,
                    const Estimator& estimate) {
  constexpr double kApart = 5.0;  // pixels between lines' intervals
  canvas.begin_clip(plot.left - 8.0, plot.top - 6.0, plot.width + 16.0, plot.height + 12.0);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const picture::Color color = picture::vehicle_color(i);
    const double aside =
        kApart * (static_cast<double>(i) - 0.5 * static_cast<double>(lines.size() - 1));
    std::vector<std::pair<double, double>> way;
    for (const auto& [x, runs] : lines[i].by_value) {
      const auto e = estimate(runs);
      if (!e) continue;
      const auto [px, py] = plot.at(x, e->value);
      canvas.line(
          {{px + aside, plot.at(x, e->low).second}, {px + aside, plot.at(x, e->high).second}},
          1.6,
          color,
          0.7);
      way.emplace_back(px + aside, py);
    }
    if (way.size() > 1) canvas.line(way, 2.0, color);
    for (const auto& [x, y] : way) canvas.dot(x, y, 3.2, color);
  }
  canvas.end_clip();
  picture::draw_axes(canvas, plot);
}

struct Panel {
  std::string caption;
  std::string label;
  Estimator estimate;
  bool is_rate = true;
};

std::vector<Panel> panels_for(const Results& results) {
  std::vector<Panel> panels = {
      {"completed: share and its 95 % interval", "completed (%)", rate(Counted::kCompleted)}};
  Runs all;
  for (const auto& [number, run] : results) all.push_back(&run);
  if (rate_of(all, Counted::kCollision).of > 0) {
    panels.push_back({"with a collision: share and its 95 % interval",
                      "collided (%)",
                      rate(Counted::kCollision)});
  }
  if (spread_of(all, "closest_approach").count > 0) {
    panels.push_back({"closest approach: median, 5th to 95th percentile",
                      "closest approach (m)",
                      closest_approach,
                      false});
  }
  return panels;
}

/// What holds all intervals, and zero.
std::pair<double, double> extent(const std::vector<Line>& lines, const Estimator& estimate) {
  std::pair<double, double> all = {0.0, 0.0};
  for (const Line& line : lines) {
    for (const auto& [x, runs] : line.by_value) {
      const auto e = estimate(runs);
      if (!e) continue;
      all.first = std::min(all.first, e->low);
      all.second = std::max(all.second, e->high);
    }
  }
  const double room = std::max(0.1, 0.05 * (all.second - all.first));
  return {all.first < 0.0 ? all.first - room : 0.0, all.second + room};
}

std::unique_ptr<picture::Canvas> plot_of(const Plan& plan,
                                         const Results& results,
                                         std::size_t axis,
                                         std::vector<Line> lines) {
  std::string title = plan.keys[axis];
  if (lines.size() > kMostPlotLines) {
    title += fmt::format(
        " (the first {} of {} combinations; all are in points.csv)", kMostPlotLines, lines.size());
    lines.resize(kMostPlotLines);
  }
  const std::vector<Panel> panels = panels_for(results);
  std::vector<picture::LegendEntry> legend;
  for (std::size_t i = 0; i < lines.size() && lines.size() > 1; ++i) {
    legend.push_back({lines[i].name, 14.0, [i](picture::Canvas& c, double x, double y) {
                        c.line({{x, y}, {x + 14.0, y}}, 2.0, picture::vehicle_color(i));
                      }});
  }
  const double left = picture::kLeftRoom + 6.0;
  const double legend_height =
      legend.empty() ? 0.0 : picture::kLegendRow * picture::legend_rows(legend, kRatesWidth) + 8.0;
  const double top = kRatesTop + legend_height;
  auto canvas = std::make_unique<picture::Canvas>(
      static_cast<int>(left + kRatesWidth + kRatesMargin),
      static_cast<int>(top + static_cast<double>(panels.size()) * (kRatesHeight + kRatesGap)),
      picture::kPaper,
      true);
  canvas->text_within(left, 30.0, title, picture::kTitleText, kRatesWidth, picture::kInk);
  if (!legend.empty()) picture::draw_legend(*canvas, legend, left, 52.0, kRatesWidth);
  double low_x = lines[0].by_value.begin()->first;
  double high_x = low_x;
  for (const Line& line : lines) {
    low_x = std::min(low_x, line.by_value.begin()->first);
    high_x = std::max(high_x, line.by_value.rbegin()->first);
  }
  const double room = 0.04 * (high_x - low_x);
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const Panel& panel = panels[i];
    const auto [low, high] = panel.is_rate ? std::pair(0.0, 100.0) : extent(lines, panel.estimate);
    const picture::Plot plot{
        left,
        top + static_cast<double>(i) * (kRatesHeight + kRatesGap),
        kRatesWidth,
        kRatesHeight,
        {low_x - room, high_x + room, plan.keys[axis], picture::Steps::kDecimal},
        {low, high, panel.label, picture::Steps::kDecimal}};
    canvas->text(left, plot.top - 9.0, panel.caption, picture::kTickText, picture::kDim);
    draw_estimates(*canvas, plot, lines, panel.estimate);
  }
  return canvas;
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<') {
      out += "&lt;";
    } else if (c == '&') {
      out += "&amp;";
    } else if (c == '>') {
      out += "&gt;";
    } else {
      out += c;
    }
  }
  return out;
}

/// A picture as part of a page, if names are the page's: each picture's get a word in front.
std::string inlined(std::string svg, const std::string& prefix) {
  svg.erase(0, std::min(svg.find("<svg"), svg.size()));
  for (const std::string_view before : {"id=\"", "href=\"#", "url(#"}) {
    for (std::size_t at = 0; (at = svg.find(before, at)) != std::string::npos;) {
      at += before.size();
      svg.insert(at, prefix);
    }
  }
  return svg;
}

std::string row(const std::vector<std::string>& cells, const char* tag = "td") {
  std::string html = "<tr>";
  for (const std::string& cell : cells) html += fmt::format("<{0}>{1}</{0}>", tag, escaped(cell));
  return html + "</tr>\n";
}

std::string percent(const Rate& rate) {
  if (rate.of == 0) return "";
  return fmt::format(
      "{:.1f} % ({:.1f} to {:.1f})", 100.0 * rate.value, 100.0 * rate.low, 100.0 * rate.high);
}

std::string points_table(const Plan& plan, const std::vector<Runs>& points) {
  std::vector<std::string> head(plan.keys.begin(),
                                plan.keys.begin() + static_cast<std::ptrdiff_t>(plan.grid_keys));
  for (const char* name :
       {"flights", "completed", "with a collision", "failed", "closest approach, median (m)"}) {
    head.emplace_back(name);
  }
  std::string html = "<table>\n" + row(head, "th");
  for (std::size_t point = 0; point < points.size(); ++point) {
    const Runs& runs = points[point];
    std::vector<std::string> cells = plan.point_values[point];
    cells.push_back(std::to_string(runs.size()));
    for (const Counted counted : {Counted::kCompleted, Counted::kCollision, Counted::kFailed}) {
      cells.push_back(percent(rate_of(runs, counted)));
    }
    const Spread approach = spread_of(runs, "closest_approach");
    cells.push_back(approach.count == 0 ? "" : fmt::format("{:.2f}", approach.median));
    html += row(cells);
  }
  return html + "</table>\n";
}

std::string spreads_table(const Runs& all) {
  std::string html =
      "<table>\n" +
      row({"", "flights", "mean", "least", "5 %", "median", "95 %", "greatest"}, "th");
  for (const std::string& column : number_columns(all)) {
    const Spread s = spread_of(all, column);
    if (s.count == 0) continue;
    std::vector<std::string> cells = {column, std::to_string(s.count)};
    for (const double x : {s.mean, s.least, s.p05, s.median, s.p95, s.greatest}) {
      cells.push_back(fmt::format("{:.4g}", x));
    }
    html += row(cells);
  }
  return html + "</table>\n";
}

}  // namespace

std::vector<CampaignPlot> campaign_plots(const Plan& plan, const Results& results) {
  std::vector<CampaignPlot> plots;
  if (results.empty()) return plots;
  const auto points = by_point(plan, results);
  for (std::size_t axis = 0; axis < plan.grid_keys; ++axis) {
    std::vector<Line> lines = lines_over(plan, points, axis);
    if (lines.empty() || lines.front().by_value.size() < 2) continue;
    plots.push_back({plan.keys[axis], plot_of(plan, results, axis, std::move(lines))});
  }
  return plots;
}

std::string campaign_html(const Campaign& campaign,
                          const Results& results,
                          const std::vector<CampaignPlot>& plots,
                          const std::vector<FailedRun>& failed) {
  const Plan& plan = campaign.plan();
  Runs all;
  for (const auto& [number, run] : results) all.push_back(&run);
  std::string html =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>campaign</title><style>\n"
      "body { font: 14px/1.5 system-ui, sans-serif; max-width: 1100px; margin: 2em auto; padding: "
      "0 "
      "1em; color: #26262e; }\n"
      "table { border-collapse: collapse; margin: 1em 0; font-variant-numeric: tabular-nums; }\n"
      "td, th { border-bottom: 1px solid #ddd; padding: 3px 12px 3px 0; text-align: left; "
      "white-space: nowrap; }\n"
      "svg { max-width: 100%; height: auto; display: block; margin: 1em 0; }\n"
      "code, pre { background: #f3f3f5; padding: 1px 4px; border-radius: 3px; }\n"
      "pre { padding: 8px; overflow-x: auto; }\n</style></head><body>\n";
  html += fmt::format(
      "<h1>{} flights of {}</h1>\n", results.size(), escaped(campaign.study().scenario));
  const std::size_t draws = campaign.study().draw_count;
  html += fmt::format(
      "<p>{} planned: {} points of the grid, {}{} seeds. Completed {}; failed {}. "
      "Rates with their 95 % intervals by Wilson.</p>\n",
      plan.runs.size(),
      plan.point_values.size(),
      draws > 1 ? fmt::format("{} draws, ", draws) : "",
      campaign.study().seeds.size(),
      percent(rate_of(all, Counted::kCompleted)),
      percent(rate_of(all, Counted::kFailed)));
  html += points_table(plan, by_point(plan, results));
  for (std::size_t i = 0; i < plots.size(); ++i) {
    html += inlined(plots[i].canvas->svg(), fmt::format("plot{}-", i)) + "\n";
  }
  html += "<h2>All flights</h2>\n" + spreads_table(all);
  if (!failed.empty()) {
    html += "<h2>Failed</h2>\n<table>\n" + row({"flight", "why", "log", "again"}, "th");
    for (const FailedRun& run : failed) {
      html += row({std::to_string(run.number), run.reason, run.log, run.command});
    }
    html += "</table>\n";
  }
  return html + "</body></html>\n";
}

}  // namespace pointflight::apps
