#include "pointflight/campaign/statistics.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/settings.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {
namespace {

constexpr Named<Counted> kCounted[] = {{Counted::kCompleted, "completed_rate"},
                                       {Counted::kCollision, "collision_rate"},
                                       {Counted::kFailed, "failed_rate"}};

/// Of a sorted list.
double quantile(const std::vector<double>& sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

struct Statistic {
  const char* name;
  double Spread::*value;
};
constexpr std::array<Statistic, 6> kStatistics = {{{"mean", &Spread::mean},
                                                   {"min", &Spread::least},
                                                   {"p05", &Spread::p05},
                                                   {"median", &Spread::median},
                                                   {"p95", &Spread::p95},
                                                   {"max", &Spread::greatest}}};

/// A cell; quoted if it would be several (RFC 4180).
std::string cell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + "\"";
}

std::string cell(const std::optional<double>& number) {
  return number ? fmt::format("{}", *number) : std::string();
}

std::set<std::string> figures_of(const Results& results) {
  std::set<std::string> names;
  for (const auto& [number, run] : results) {
    for (const auto& [name, value] : run.figures) names.insert(name);
  }
  return names;
}

[[noreturn]] void refuse(const std::string& text) {
  throw InputError(fmt::format(
      "--fail-if {}: write it like collision_rate > 0.02; on the left completed_rate, "
      "collision_rate, failed_rate, or mean, min, p05, median, p95, max of a column of runs.csv, "
      "such as min(closest_approach)",
      text));
}

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

}  // namespace

Rate wilson(std::size_t count, std::size_t of) {
  constexpr double kZ = 1.959963984540054;  // of 95 %, both sides
  Rate rate{count, of, 0.0, 0.0, 1.0};
  if (of == 0) return rate;
  const auto n = static_cast<double>(of);
  const double p = static_cast<double>(count) / n;
  const double middle = (p + kZ * kZ / (2.0 * n)) / (1.0 + kZ * kZ / n);
  const double half =
      kZ / (1.0 + kZ * kZ / n) * std::sqrt(p * (1.0 - p) / n + kZ * kZ / (4.0 * n * n));
  rate.value = p;
  rate.low = count == 0 ? 0.0 : std::max(0.0, middle - half);
  rate.high = count == of ? 1.0 : std::min(1.0, middle + half);
  return rate;
}

std::string_view name_of(Counted counted) {
  return name_in(kCounted, counted);
}

Rate rate_of(const std::vector<const RunRecord*>& runs, Counted counted) {
  std::size_t count = 0;
  std::size_t of = 0;
  for (const RunRecord* run : runs) {
    if (counted == Counted::kCollision && !run->collisions) continue;
    ++of;
    const bool counts = counted == Counted::kCompleted   ? run->status == RunStatus::kCompleted
                        : counted == Counted::kCollision ? *run->collisions > 0
                                                         : run->status == RunStatus::kFailed;
    count += counts ? 1 : 0;
  }
  return wilson(count, of);
}

std::optional<double> number_of(const RunRecord& run, const std::string& column) {
  for (const SummaryFigure& known : kSummaryFigures) {
    if (column == known.name) return run.*known.value;
  }
  if (column == "collisions") {
    if (!run.collisions) return std::nullopt;
    return static_cast<double>(*run.collisions);
  }
  if (column == "wall_seconds") return run.wall_seconds;
  if (column == "real_time_factor") return run.real_time_factor;
  const auto figure = run.figures.find(column);
  return figure == run.figures.end() ? std::nullopt : std::optional(figure->second);
}

std::vector<std::string> number_columns(const std::vector<const RunRecord*>& runs) {
  std::vector<std::string> names = {"collisions"};
  for (const SummaryFigure& column : kSummaryFigures) names.emplace_back(column.name);
  names.emplace_back("wall_seconds");
  names.emplace_back("real_time_factor");
  std::set<std::string> own;
  for (const RunRecord* run : runs) {
    for (const auto& [name, value] : run->figures) own.insert(name);
  }
  names.insert(names.end(), own.begin(), own.end());
  return names;
}

Spread spread_of(const std::vector<const RunRecord*>& runs, const std::string& column) {
  std::vector<double> values;
  for (const RunRecord* run : runs) {
    if (const auto value = number_of(*run, column)) values.push_back(*value);
  }
  Spread spread;
  spread.count = values.size();
  if (values.empty()) return spread;
  std::sort(values.begin(), values.end());
  for (const double value : values) spread.mean += value;
  spread.mean /= static_cast<double>(values.size());
  spread.least = values.front();
  spread.p05 = quantile(values, 0.05);
  spread.median = quantile(values, 0.5);
  spread.p95 = quantile(values, 0.95);
  spread.greatest = values.back();
  return spread;
}

std::string runs_csv(const Plan& plan, const Results& results) {
  const std::set<std::string> figures = figures_of(results);
  std::string csv = "run,point,seed";
  for (const std::string& key : plan.keys) csv += "," + cell(key);
  csv += ",status,reason,end,collisions";
  for (const SummaryFigure& column : kSummaryFigures) csv += fmt::format(",{}", column.name);
  for (const std::string& name : figures) csv += "," + cell(name);
  csv += "\n";
  for (const auto& [number, run] : results) {
    const PlannedRun& planned = plan.runs[number];
    csv += fmt::format("{},{},{}", number, planned.point, planned.seed);
    for (const std::string& value : planned.values) csv += "," + cell(value);
    csv += fmt::format(",{},{},{},{}",
                       name_of(run.status),
                       cell(run.reason),
                       cell(run.end),
                       run.collisions ? std::to_string(*run.collisions) : "");
    for (const SummaryFigure& column : kSummaryFigures) csv += "," + cell(run.*column.value);
    for (const std::string& name : figures) {
      const auto figure = run.figures.find(name);
      csv += "," + (figure == run.figures.end() ? std::string() : cell(figure->second));
    }
    csv += "\n";
  }
  return csv;
}

std::string timing_csv(const Results& results) {
  std::string csv = "run,wall_seconds,real_time_factor\n";
  for (const auto& [number, run] : results) {
    csv += fmt::format("{},{:.3f},{}\n", number, run.wall_seconds, cell(run.real_time_factor));
  }
  return csv;
}

std::vector<std::vector<const RunRecord*>> by_point(const Plan& plan, const Results& results) {
  std::vector<std::vector<const RunRecord*>> points(plan.point_values.size());
  for (const auto& [number, run] : results) points[plan.runs[number].point].push_back(&run);
  return points;
}

std::string points_csv(const Plan& plan, const Results& results) {
  std::string csv = "point";
  for (std::size_t i = 0; i < plan.grid_keys; ++i) csv += "," + cell(plan.keys[i]);
  csv += ",runs";
  for (const Named<Counted>& row : kCounted) {
    csv += fmt::format(",{0},{0}_low,{0}_high", row.name);
  }
  for (const SummaryFigure& column : kSummaryFigures) csv += fmt::format(",median_{}", column.name);
  csv += "\n";
  const auto points = by_point(plan, results);
  for (std::size_t point = 0; point < points.size(); ++point) {
    csv += fmt::format("{}", point);
    for (const std::string& value : plan.point_values[point]) csv += "," + cell(value);
    csv += fmt::format(",{}", points[point].size());
    for (const Named<Counted>& row : kCounted) {
      const Rate rate = rate_of(points[point], row.value);
      csv += rate.of == 0 ? ",,,"
                          : fmt::format(",{:.6g},{:.6g},{:.6g}", rate.value, rate.low, rate.high);
    }
    for (const SummaryFigure& column : kSummaryFigures) {
      const Spread spread = spread_of(points[point], column.name);
      csv += "," + (spread.count == 0 ? std::string() : fmt::format("{:.9g}", spread.median));
    }
    csv += "\n";
  }
  return csv;
}

Condition::Condition(std::string text) : text_(std::move(text)) {
  const std::size_t at = text_.find_first_of("<>=");
  if (at == std::string::npos) refuse(text_);
  const std::size_t end = text_.find_first_not_of("<>=", at);
  if (end == std::string::npos) refuse(text_);
  comparison_ = text_.substr(at, end - at);
  const bool is_known = comparison_ == "<" || comparison_ == "<=" || comparison_ == ">" ||
                        comparison_ == ">=" || comparison_ == "==";
  if (!is_known || !parse_number(trimmed(text_.substr(end)), limit_) || !std::isfinite(limit_)) {
    refuse(text_);
  }
  const std::string left = trimmed(text_.substr(0, at));
  for (const Named<Counted>& row : kCounted) {
    if (left == row.name) {
      function_ = left;
      return;
    }
  }
  const std::size_t open = left.find('(');
  if (open == std::string::npos || !left.ends_with(')')) refuse(text_);
  function_ = trimmed(left.substr(0, open));
  column_ = trimmed(left.substr(open + 1, left.size() - open - 2));
  const bool is_statistic =
      std::any_of(kStatistics.begin(), kStatistics.end(), [&](const Statistic& statistic) {
        return function_ == statistic.name;
      });
  if (!is_statistic || column_.empty()) refuse(text_);
}

double Condition::value(const std::vector<const RunRecord*>& runs) const {
  for (const Named<Counted>& row : kCounted) {
    if (function_ != row.name) continue;
    const Rate rate = rate_of(runs, row.value);
    if (rate.of == 0) {
      throw InputError(fmt::format(
          "--fail-if {}: no run tells of it (a planner of yours has to leave summary.json)",
          text_));
    }
    return rate.value;
  }
  const Spread spread = spread_of(runs, column_);
  if (spread.count == 0) {
    throw InputError(fmt::format("--fail-if {}: no run tells of {}; columns: {}",
                                 text_,
                                 column_,
                                 fmt::join(number_columns(runs), ", ")));
  }
  for (const Statistic& statistic : kStatistics) {
    if (function_ == statistic.name) return spread.*statistic.value;
  }
  return 0.0;
}

bool Condition::holds(const std::vector<const RunRecord*>& runs) const {
  const double left = value(runs);
  if (comparison_ == "<") return left < limit_;
  if (comparison_ == "<=") return left <= limit_;
  if (comparison_ == ">") return left > limit_;
  if (comparison_ == ">=") return left >= limit_;
  return left == limit_;
}

}  // namespace pointflight
