#include "pointflight/campaign/run_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/settings.hpp"

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

std::optional<double> number_in(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
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
      record.collisions = record.collisions.value_or(0) + static_cast<std::int64_t>(*collisions);
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
    record.collisions = static_cast<std::int64_t>(value);
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
    throw InputError(fmt::format("{}: is no result of a run; remove its folder", name));
  }
  record.status = found->value;
  for (const auto& [key, to] :
       {std::pair("reason", &record.reason), std::pair("end", &record.end)}) {
    const auto at = value.find(key);
    if (at != value.end() && at->is_string()) *to = at->get<std::string>();
  }
  record.wall_seconds = number_in(value, "wall_seconds").value_or(0.0);
  if (const auto collisions = number_in(value, "collisions")) {
    record.collisions = static_cast<std::int64_t>(*collisions);
  }
  for (const SummaryFigure& figure : kSummaryFigures) {
    record.*figure.value = number_in(value, figure.name);
  }
  record.real_time_factor = number_in(value, "real_time_factor");
  const auto figures = value.find("figures");
  if (figures != value.end() && figures->is_object()) {
    for (const auto& [key, number] : figures->items()) {
      if (number.is_number()) record.figures[key] = number.get<double>();
    }
  }
  return record;
}

void read_results(const std::string& folder, const std::string& figures, RunRecord& record) {
  if (const auto summary = read_json(fs::path(folder) / "summary.json")) {
    read_summary(*summary, record);
  }
  if (const auto timing = read_json(fs::path(folder) / "timing.json")) {
    record.real_time_factor = number_in(*timing, "real_time_factor");
  }
  if (figures.empty()) return;
  const fs::path path = fs::path(folder) / figures;
  const auto own = read_json(path);
  if (!own) return;
  for (const auto& [key, value] : own->items()) {
    if (!value.is_number()) {
      throw InputError(fmt::format("{}: {}: figures are numbers", path.string(), key));
    }
    try {
      take_figure(key, value.get<double>(), record);
    } catch (const InputError& problem) {
      throw InputError(fmt::format("{}: {}", path.string(), problem.what()));
    }
  }
}

}  // namespace pointflight
