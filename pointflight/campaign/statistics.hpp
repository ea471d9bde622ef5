// Rates, intervals and tables of a campaign's results.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/campaign/plan.hpp"
#include "pointflight/campaign/run_record.hpp"

namespace pointflight {

/// A fraction with its 95 % confidence interval.
struct Rate {
  /// Runs with that outcome; runs in all.
  ///@{
  std::size_t count = 0, of = 0;
  ///@}
  double value = 0.0;  ///< count / of; 0 of none.
  /// Wilson score interval (1927): right for few runs and near 0 and 1 too.
  ///@{
  double low = 0.0, high = 1.0;
  ///@}
};
/// Throws nothing; 0 of 0 is anything from 0 to 1.
Rate wilson(std::size_t count, std::size_t of);

/// Outcomes of runs whose rates are reported.
enum class Counted {
  kCompleted,  ///< Exit code 0.
  kCollision,  ///< With a collision at least, of runs that tell.
  kFailed,     ///< As `RunStatus`.
};
/// "completed_rate", "collision_rate", "failed_rate".
std::string_view name_of(Counted counted);
/// Of these runs.
Rate rate_of(const std::vector<const RunRecord*>& runs, Counted counted);

/// A number of a run by its column in runs.csv: "closest_approach", "wall_seconds", or a figure of
/// the user's; nothing if the run does not tell.
std::optional<double> number_of(const RunRecord& run, const std::string& column);
/// Columns that `number_of` knows, of these runs.
std::vector<std::string> number_columns(const std::vector<const RunRecord*>& runs);

/// Of a column: order statistics by linear interpolation (Hyndman and Fan's type 7).
struct Spread {
  std::size_t count = 0;  ///< Runs that have the figure.
  double mean = 0.0;      ///< Arithmetic.
  /// Minimum and maximum.
  ///@{
  double least = 0.0, greatest = 0.0;
  ///@}
  /// Percentiles: 5, 50, 95.
  ///@{
  double p05 = 0.0, median = 0.0, p95 = 0.0;
  ///@}
};
/// The spread of a column over these runs.
Spread spread_of(const std::vector<const RunRecord*>& runs, const std::string& column);

/// The results of a campaign by number; a run without one is not there.
using Results = std::map<std::size_t, RunRecord>;

/// A row for each flight that has a result, in the order of the plan: number, point, seed, values,
/// how it ended, figures. The same bytes however and wherever they were flown.
std::string runs_csv(const Plan& plan, const Results& results);
/// What clocks say of each: not the same twice.
std::string timing_csv(const Results& results);
/// A row for each point of the grid: rates with their intervals, medians.
std::string points_csv(const Plan& plan, const Results& results);
/// Results of each point, by its number.
std::vector<std::vector<const RunRecord*>> by_point(const Plan& plan, const Results& results);

/// A condition on all runs together: `collision_rate > 0.02`, `p95(tracking_error_max) >= 0.3`,
/// `min(closest_approach) < 0.1`, `mean(latency) > 20`.
class Condition {
 public:
  /// Throws InputError that says what can stand there.
  explicit Condition(std::string text);
  /// As given.
  [[nodiscard]] const std::string& text() const { return text_; }
  /// Of these; throws InputError if no run tells of its column.
  [[nodiscard]] bool holds(const std::vector<const RunRecord*>& runs) const;
  /// What stands on its left.
  [[nodiscard]] double value(const std::vector<const RunRecord*>& runs) const;

 private:
  std::string text_;
  std::string function_;  ///< "collision_rate", "mean", ...
  std::string column_;    ///< Empty of rates.
  std::string comparison_;
  double limit_ = 0.0;
};

}  // namespace pointflight
