// What one flight of a campaign came to.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace pointflight {

/// How a run ended.
enum class RunStatus {
  kCompleted,  ///< Exit code 0.
  kEnded,      ///< Exit code 1: by a collision, outside of the map, its mission unfinished.
  kFailed,     ///< Another exit code, a signal, a limit of time.
};

/// Word of a status, in files.
std::string_view name_of(RunStatus status);

/// A run's results. All but `wall_seconds` and `real_time_factor` follow from scenario and seed.
struct RunRecord {
  RunStatus status = RunStatus::kFailed;  ///< As above.
  std::string reason;  ///< Of a failure: "exit code 2", "signal 11", "took longer than 600 s".
  std::string end;     ///< In the run's words: "completed", "mission unfinished".
  /// What summary.json says; nothing if a user's program left none. Of several vehicles the sum
  /// of `collisions`, the greatest errors, the closest approach.
  ///@{
  std::optional<std::int64_t> collisions;
  std::optional<double> closest_approach;    ///< m
  std::optional<double> simulated_time;      ///< s
  std::optional<double> distance_flown;      ///< m
  std::optional<double> tracking_error_rms;  ///< m
  std::optional<double> tracking_error_max;  ///< m
  ///@}
  std::map<std::string, double> figures;   ///< The user's own.
  double wall_seconds = 0.0;               ///< From start to end of its process.
  std::optional<double> real_time_factor;  ///< What timing.json says.
};

/// A number of a record that summaries have.
struct SummaryFigure {
  const char* name;                         ///< In files.
  std::optional<double> RunRecord::*value;  ///< Where it lies.
};
/// All of them but `collisions`, in the order of runs.csv.
inline constexpr std::array<SummaryFigure, 5> kSummaryFigures = {
    {{"closest_approach", &RunRecord::closest_approach},
     {"simulated_time", &RunRecord::simulated_time},
     {"distance_flown", &RunRecord::distance_flown},
     {"tracking_error_rms", &RunRecord::tracking_error_rms},
     {"tracking_error_max", &RunRecord::tracking_error_max}}};

/// As the text of a file.
std::string record_json(const RunRecord& record);
/// Throws InputError if it is no record; `name` stands for the path.
RunRecord parse_record(std::string_view json, const std::string& name);

/// Takes from a run's folder what its files say: summary.json, timing.json, and `figures` (a JSON
/// object of numbers; empty: none), in which a name of the above fills what no summary has. What is
/// not there stays open. Throws InputError if a file is none, or a figure has the name of a
/// column that is filled.
void read_results(const std::string& folder, const std::string& figures, RunRecord& record);

}  // namespace pointflight
