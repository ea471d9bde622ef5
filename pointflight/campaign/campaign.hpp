// A campaign's folder: which flights are done, and how the others are flown.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/campaign/plan.hpp"
#include "pointflight/campaign/run_record.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/sim/scenario.hpp"

namespace pointflight {

/// A study and the folder of its flights. Each flight has a folder there, `runs/000042`, that
/// appears when it is over; until then what it writes lies beside it under a name that only its
/// attempt has, so that whoever was killed leaves nothing that counts. Any number of processes on
/// any number of machines may fly parts of one campaign. `campaign.json` says of what study,
/// scenario, maps and other files it is.
class Campaign {
 public:
  /// Opens or makes the folder. `program`: our own, for flights without a command of the user's.
  /// Throws InputError if a value does not fit the scenario, and where the folder is of another
  /// study, scenario or map.
  Campaign(Study study, std::string folder, std::string program);

  [[nodiscard]] const Study& study() const { return study_; }          ///< As given.
  [[nodiscard]] const Plan& plan() const { return plan_; }             ///< Of the study.
  [[nodiscard]] const std::string& folder() const { return folder_; }  ///< As given.

  /// Flights without a result, by number.
  [[nodiscard]] std::vector<std::size_t> missing() const;
  /// Removes results of flights that failed, so that they are flown again; what the user's program
  /// wrote beside them is set aside. Returns how many.
  std::size_t forget_failed();
  /// Removes what attempts left that cannot go on: those of this machine whose process is gone, and
  /// those of this process, while it flies none.
  /// Returns how many folders stay for what the user's program has written into them.
  std::size_t remove_leftovers() const;

  /// Flies one and puts its result into the folder; nothing if `stop` or somebody outside
  /// (SIGKILL, SIGTERM) ended it. Callable from
  /// several threads and processes. Throws InputError if it cannot be started or the folder
  /// cannot be written.
  std::optional<RunRecord> fly(std::size_t number, const std::atomic<bool>& stop) const;

  /// The result of a flight; nothing if there is none. Throws InputError.
  [[nodiscard]] std::optional<RunRecord> result(std::size_t number) const;
  /// Folder of a flight, whether it is there or not.
  [[nodiscard]] std::string run_folder(std::size_t number) const;
  /// What repeats a flight, for a shell.
  [[nodiscard]] std::string repeating_command(std::size_t number) const;

 private:
  void check_folder() const;
  void take_inputs(const Scenario& scenario);
  void check_values();
  [[nodiscard]] bool fits_in_a_flight(const std::string& key, const std::string& value) const;
  [[nodiscard]] std::string scenario_text_of(const PlannedRun& run) const;
  [[nodiscard]] std::vector<std::string> command_of(const PlannedRun& run,
                                                    const std::string& scenario,
                                                    const std::string& output) const;
  [[nodiscard]] std::string identity() const;

  Study study_;
  std::string folder_;
  std::string program_;
  Plan plan_;
  std::string scenario_path_;
  std::string scenario_text_;
  /// Of maps by `Scenario::map_name`; empty for made-up worlds.
  std::map<std::string, std::string> map_hashes_;
  std::map<std::string, std::uint64_t> inputs_;  ///< Hashes of other files, by path.
};

}  // namespace pointflight
