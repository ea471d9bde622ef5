#include "pointflight/campaign/run_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/settings.hpp"
#include "pointflight/core/whole_number.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr Named<RunStatus> kStatuses[] = {{RunStatus::kCompleted, "completed"},
                                          {RunStatus::kEnded, "ended"},
                                          {RunStatus::kFailed, "failed"}};

/// Columns of runs.csv that no figure may fill.
constexpr std::array<std::string_view, 8> kReserved = {
    "run", "point", "seed", "status", "reason", "end", "wall_seconds", "real_time_factor"};

json parsed(std::string_view text, const std::string& name) {
  json value = json::parse(text.begin(), text.end(), nullptr, false);
  if (value.is_discarded() || !value.is_object()) {
    throw InputError(fmt::format("{}: is no JSON object", name));
  }
  return value;
}

/// Nothing if the file is not there.
std::optional<json> read_json(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return std::nullopt;
  return parsed(MappedFile(path.string()).text(), path.string());
}

/// A figure whose square is a number, too: statistics are made of it. Throws InputError.
double figure_of(const std::string& key, const json& value) {
  constexpr double kMost = 1e100;
  const auto number = value.get<double>();
  if (std::abs(number) <= kMost) return number;
  throw InputError(fmt::format("{}: {} is no figure of a run", key, number));
}

std::optional<double> number_in(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  return figure_of(key, *found);
}

/// Throws InputError if it is no number of collisions.
std::int64_t collisions_of(double number) {
  constexpr std::int64_t kMost = 1'000'000'000'000;
  if (const auto count = whole_number<std::int64_t>(number, 0, kMost)) return *count;
  throw InputError(fmt::format("collisions: {} is no number of them", number));
}

/// Runs `read`; what is wrong is said of the file.
template <class Read>
void in_file(const std::string& path, const Read& read) {
  try {
    read();
  } catch (const InputError& problem) {
    throw InputError(fmt::format("{}: {}", path, problem.what()));
  }
}

/// Takes `value` if there is none yet or it is farther out.
void keep_least(std::optional<double>& kept, std::optional<double> value) {
  if (value && (!kept || *value < *kept)) kept = value;
}
void keep_greatest(std::optional<double>& kept, std::optional<double> value) {
  if (value && (!kept || *value > *kept)) kept = value;
}

void read_summary(const json& summary, RunRecord& record) {
  if (const auto end = summary.find("end"); end != summary.end() && end->is_string()) {
    record.end = end->get<std::string>();
  }
  record.simulated_time = number_in(summary, "simulated_time");
  const auto vehicles = summary.find("vehicles");
  if (vehicles == summary.end() || !vehicles->is_array()) return;
  for (const json& vehicle : *vehicles) {
    if (!vehicle.is_object()) continue;
    if (const auto collisions = number_in(vehicle, "collisions")) {
      record.collisions = record.collisions.value_or(0) + collisions_of(*collisions);
    }
    if (const auto distance = number_in(vehicle, "distance_flown")) {
      record.distance_flown = record.distance_flown.value_or(0.0) + *distance;
    }
    keep_least(record.closest_approach, number_in(vehicle, "closest_approach"));
    keep_greatest(record.tracking_error_rms, number_in(vehicle, "tracking_error_rms"));
    keep_greatest(record.tracking_error_max, number_in(vehicle, "tracking_error_max"));
  }
}

/// A figure of the user's; one that a summary has as well fills its column if there is none.
void take_figure(const std::string& name, double value, RunRecord& record) {
  if (std::find(kReserved.begin(), kReserved.end(), name) != kReserved.end()) {
    throw InputError(name + ": is a column of runs.csv; give the figure another name");
  }
  const auto has_already = [&] {
    throw InputError(name + ": is said by summary.json; give the figure another name");
  };
  if (name == "collisions") {
    if (record.collisions) has_already();
    record.collisions = collisions_of(value);
    return;
  }
  for (const SummaryFigure& figure : kSummaryFigures) {
    if (name != figure.name) continue;
    if (record.*figure.value) has_already();
    record.*figure.value = value;
    return;
  }
  record.figures[name] = value;
}

}  // namespace

std::string_view name_of(RunStatus status) {
  return name_in(kStatuses, status);
}

std::string record_json(const RunRecord& record) {
  json value = {{"status", name_of(record.status)},
                {"reason", record.reason},
                {"end", record.end},
                {"wall_seconds", record.wall_seconds},
                {"figures", record.figures}};
  if (record.collisions) value["collisions"] = *record.collisions;
  if (record.real_time_factor) value["real_time_factor"] = *record.real_time_factor;
  for (const SummaryFigure& figure : kSummaryFigures) {
    if (const auto& number = record.*figure.value) value[figure.name] = *number;
  }
  return value.dump(1, ' ', false, json::error_handler_t::replace) + "\n";
}

RunRecord parse_record(std::string_view text, const std::string& name) {
  const json value = parsed(text, name);
  RunRecord record;
  const auto status = value.find("status");
  const std::string word =
      status != value.end() && status->is_string() ? status->get<std::string>() : "";
  const auto* found = std::find_if(std::begin(kStatuses),
                                   std::end(kStatuses),
                                   [&](const auto& row) { return row.name == word; });
  if (found == std::end(kStatuses)) {
    throw InputError(
        fmt::format("{}: is no result of a run; remove its folder, and it is flown again", name));
  }
  record.status = found->value;
  for (const auto& [key, to] :
       {std::pair("reason", &record.reason), std::pair("end", &record.end)}) {
    const auto at = value.find(key);
    if (at != value.end() && at->is_string()) *to = at->get<std::string>();
  }
  in_file(name, [&] {
    record.wall_seconds = number_in(value, "wall_seconds").value_or(0.0);
    if (const auto collisions = number_in(value, "collisions")) {
      record.collisions = collisions_of(*collisions);
    }
    for (const SummaryFigure& figure : kSummaryFigures) {
      record.*figure.value = number_in(value, figure.name);
    }
    record.real_time_factor = number_in(value, "real_time_factor");
    const auto figures = value.find("figures");
    if (figures == value.end() || !figures->is_object()) return;
    for (const auto& [key, number] : figures->items()) {
      if (number.is_number()) record.figures[key] = figure_of(key, number);
    }
  });
  return record;
}

void read_results(const std::string& folder, const std::string& figures, RunRecord& record) {
  const fs::path summary_path = fs::path(folder) / "summary.json";
  if (const auto summary = read_json(summary_path)) {
    in_file(summary_path.string(), [&] { read_summary(*summary, record); });
  }
  const fs::path timing_path = fs::path(folder) / "timing.json";
  if (const auto timing = read_json(timing_path)) {
    in_file(timing_path.string(),
            [&] { record.real_time_factor = number_in(*timing, "real_time_factor"); });
  }
  if (figures.empty()) return;
  const fs::path path = fs::path(folder) / figures;
  const auto own = read_json(path);
  if (!own) return;
  for (const auto& [key, value] : own->items()) {
    if (!value.is_number()) {
      throw InputError(fmt::format("{}: {}: figures are numbers", path.string(), key));
    }
    in_file(path.string(),
            [&, &key = key, &value = value] { take_figure(key, figure_of(key, value), record); });
  }
}

}  // namespace pointflight
