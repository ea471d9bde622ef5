#include "pointflight/campaign/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>
#include <utility>

#include "pointflight/campaign/internal/attempt.hpp"
#include "pointflight/campaign/process.hpp"
#include "pointflight/core/hash.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/core/owned_files.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/core/shell_words.hpp"
#include "pointflight/core/version.hpp"
#include "pointflight/sim/run_folder.hpp"
#include "pointflight/sim/scenario.hpp"
#include "pointflight/sim/scenario_copy.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

constexpr const char* kIdentity = "campaign.json";

void replace_all(std::string& text, std::string_view what, const std::string& by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size()) {
    text.replace(at, what.size(), by);
  }
}

void judge(const ProcessResult& ended, const Study& study, RunRecord& record) {
  record.wall_seconds = ended.wall_seconds;
  if (ended.exit_code < 0 && ended.signal == 0) {
    record.reason = "nobody knows how it ended";
  } else if (ended.timed_out) {
    record.reason = fmt::format("took longer than {:g} s", study.time_limit);
  } else if (ended.signal != 0) {
    record.reason = fmt::format("signal {}", ended.signal);
  } else if (ended.exit_code > 1) {
    record.reason = fmt::format("exit code {}", ended.exit_code);
  } else {
    record.status = ended.exit_code == 0 ? RunStatus::kCompleted : RunStatus::kEnded;
  }
}

}  // namespace

Campaign::Campaign(Study study, std::string folder, std::string program)
    : study_(std::move(study)),
      folder_(std::move(folder)),
      program_(std::move(program)),
      plan_(plan_of(study_)),
      scenario_path_(resolve_path(study_.scenario, fs::path(study_.path).parent_path().string())),
      scenario_text_(MappedFile(scenario_path_).text()) {
  take_inputs(load_scenario(scenario_path_));
  check_values();
  check_folder();
}

/// Its map, and what else it takes from files.
void Campaign::take_inputs(const Scenario& scenario) {
  // the map of a world follows from the scenario, and takes a while to make
  std::string& hash = map_hashes_[scenario.map_name()];
  if (hash.empty() && !scenario.world) hash = scenario.open_map()->hash();
  for (const std::string& path : files_of(scenario)) {
    if (inputs_.contains(path)) continue;
    inputs_[path] = hash64(MappedFile(path).bytes());
  }
}

/// A value fits beside those of the first flight that has it (an end of a draw: beside the first
/// flight's).
bool Campaign::fits_in_a_flight(const std::string& key, const std::string& value) const {
  const auto found = std::find(plan_.keys.begin(), plan_.keys.end(), key);
  if (found == plan_.keys.end()) return false;
  const auto place = static_cast<std::size_t>(found - plan_.keys.begin());
  const auto run = std::find_if(plan_.runs.begin(), plan_.runs.end(), [&](const PlannedRun& r) {
    return r.values[place] == value;
  });
  PlannedRun flown = run == plan_.runs.end() ? plan_.runs.front() : *run;
  flown.values[place] = value;
  try {
    parse_scenario(scenario_text_of(flown), scenario_path_);
    return true;
  } catch (const InputError&) {
    return false;
  }
}

/// Each value of each axis, and the ends of each draw, fit the scenario, and their files are there.
void Campaign::check_values() {
  const auto check = [&](const std::string& key, const std::string& value, int line) {
    const auto refuse = [&](const InputError& error) {
      // lines are of the edited text, which nobody sees
      std::string why = error.what();
      if (why.starts_with(scenario_path_ + ":")) {
        why.erase(0, std::min(why.find(": ") + 2, why.size()));
      }
      if (why.find(key) == std::string::npos) why.insert(0, key + ": ");
      throw InputError(fmt::format("{}:{}: {}", study_.path, line, why));
    };
    Scenario scenario;
    try {
      scenario = parse_scenario(edited_scenario(scenario_text_, {key}, {value}), scenario_path_);
    } catch (const InputError& error) {
      if (fits_in_a_flight(key, value)) return;  // it makes sense beside other keys' values only
      refuse(error);
    }
    try {
      take_inputs(scenario);
    } catch (const InputError& error) {
      refuse(error);
    }
  };
  constexpr std::size_t kMost = 1000;  // of a long list: a second
  for (const StudyAxis& axis : study_.grid) {
    const std::size_t stride = std::max<std::size_t>(1, axis.values.size() / kMost);
    for (std::size_t i = 0; i < axis.values.size(); i += stride) {
      check(axis.key, axis.values[i], axis.line);
    }
    check(axis.key, axis.values.back(), axis.line);
  }
  for (const StudyDraw& draw : study_.draws) {
    for (const std::string& end : extremes_of(draw)) check(draw.key, end, draw.line);
  }
}

std::string Campaign::identity() const {
  std::string all;
  for (const PlannedRun& run : plan_.runs) {
    all += fmt::format("{} {}", run.point, run.seed);
    for (const std::string& value : run.values) all += "\t" + value;
    all += '\n';
  }
  const auto hash = [](const std::string& text) {
    return fmt::format("{:016x}", hash64(std::as_bytes(std::span(text))));
  };
  std::string command;
  for (const std::string& word : study_.command) command += word + '\0';
  std::string maps;
  for (const auto& [path, hash] : map_hashes_) maps += hash + "\n";
  std::string inputs;  // by what they hold: where they lie may differ from host to host
  for (const auto& [path, content] : inputs_) {
    inputs += fmt::format("{} {:016x}\n", fs::path(path).filename().string(), content);
  }
  const nlohmann::ordered_json identity = {{"pointflight", kVersion},
                                           {"flights", plan_.runs.size()},
                                           {"plan_hash", hash(all)},
                                           {"scenario_hash", hash(scenario_text_)},
                                           {"command_hash", hash(command)},
                                           {"maps_hash", hash(maps)},
                                           {"inputs_hash", hash(inputs)},
                                           {"figures", study_.figures}};
  return identity.dump(1) + "\n";
}

/// Several processes may come at once: all write the same.
void Campaign::check_folder() const {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw InputError(fmt::format("{}: {}", folder_, error.message()));
  const Folder home(folder_);
  const auto is_ours = [](const std::string& name) {
    return name.substr(name.starts_with('.') ? 1 : 0).starts_with(kIdentity);
  };
  const std::vector<std::string> names = home.names();
  if (!std::ranges::any_of(names, [](const std::string& name) { return name == kIdentity; })) {
    if (!std::ranges::all_of(names, is_ours)) {  // those of others who begin it as well
      throw InputError(
          fmt::format("{}: is not empty, and no campaign; choose another folder", folder_));
    }
    const std::string own = fmt::format("{}.{}-{}", kIdentity, host_name(), getpid());
    home.write(own, identity());
    const int refused = home.rename(own, home, kIdentity);
    if (refused == EEXIST) home.remove_file(own);  // one of them was first
    if (refused != 0 && refused != EEXIST) {
      throw InputError(
          fmt::format("{}/{}: {}", folder_, kIdentity, std::generic_category().message(refused)));
    }
  }
  constexpr std::size_t kLongest = std::size_t{1} << 24u;  // bytes
  if (home.read(kIdentity, kLongest) != identity()) {
    throw InputError(fmt::format(
        "{}: is the campaign of another study, scenario, map, input or version; choose another "
        "folder",
        folder_));
  }
  if (!home.make(kFlights)) {
    throw InputError(fmt::format(
        "{}/{}: cannot be used as a folder: it is a link, a file, a mount or not writable; give "
        "another with -o",
        folder_,
        kFlights));
  }
}

std::string Campaign::run_folder(std::size_t number) const {
  return (fs::path(folder_) / flight_name(number)).string();
}

std::vector<std::size_t> Campaign::missing() const {
  std::set<std::string> there;
  std::error_code error;
  for (fs::directory_iterator at(fs::path(folder_) / "runs", error);
       !error && at != fs::directory_iterator();
       at.increment(error)) {
    std::error_code ignored;
    const bool is_over = fs::exists(at->path() / kFlightResult, ignored);
    if (is_over) there.insert(at->path().filename().string());
  }
  std::vector<std::size_t> missing;
  for (const PlannedRun& run : plan_.runs) {
    if (!there.contains(fmt::format("{:06}", run.number))) missing.push_back(run.number);
  }
  return missing;
}

std::size_t Campaign::forget_failed() {
  const Folder home(folder_);
  std::size_t count = 0;
  for (const PlannedRun& run : plan_.runs) {
    const auto record = result(run.number);
    if (!record || record->status != RunStatus::kFailed) continue;
    // at one stroke: whoever is killed meanwhile leaves no half of a result
    const std::string name = flight_name(run.number);
    if (!home.remove_file(name + "/" + kFlightResult)) {
      throw InputError(
          fmt::format("{}/{}: cannot be removed", run_folder(run.number), kFlightResult));
    }
    remove_flight(home, name);
    ++count;
  }
  return count;
}

std::size_t Campaign::remove_leftovers() const {
  const Folder home(folder_);
  const auto runs = home.below(kFlights);
  const std::string ours = kFlightAttempt + host_name() + "-";
  std::size_t left = 0;
  for (const std::string& name : runs ? runs->names() : std::vector<std::string>()) {
    const std::size_t found = name.find(ours);
    if (found == std::string::npos) continue;
    // a process and a count, and no more: else another host's name begins as this one's
    const std::string rest = name.substr(found + ours.size());
    int pid = 0;
    int attempt = 0;
    int read = 0;
    // NOLINTNEXTLINE(cert-err34-c): names are made by `make_attempt`; others are left alone
    const int fields = std::sscanf(rest.c_str(), "%d-%d%n", &pid, &attempt, &read);
    if (fields != 2 || rest.size() != static_cast<std::size_t>(read)) continue;
    if (pid <= 0) continue;
    const bool is_gone =
        pid == getpid() || (kill(static_cast<pid_t>(pid), 0) != 0 && errno == ESRCH);
    if (!is_gone) continue;
    if (runs->entry(name) != Entry::kFolder) continue;
    // containers have process numbers of their own: whoever flies there fills the folder
    if (is_being_filled(*runs, name)) continue;
    left += remove_flight(*runs, name) ? 0 : 1;
  }
  return left;
}

std::optional<RunRecord> Campaign::result(std::size_t number) const {
  const fs::path path = fs::path(run_folder(number)) / kFlightResult;
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return std::nullopt;
  return parse_record(MappedFile(path.string()).text(), path.string());
}

std::string Campaign::scenario_text_of(const PlannedRun& run) const {
  std::vector<std::string> keys = plan_.keys;
  std::vector<std::string> values = run.values;
  keys.emplace_back("seed");
  values.push_back(std::to_string(run.seed));
  return edited_scenario(scenario_text_, keys, values);
}

std::vector<std::string> Campaign::command_of(const PlannedRun& run,
                                              const std::string& scenario,
                                              const std::string& output) const {
  if (study_.command.empty()) {
    // as many at once as there are cores: one thread each
    return {program_, "fly", scenario, "-o", output, "--force", "--threads", "1", "--no-picture"};
  }
  std::vector<std::string> command = study_.command;
  for (std::string& word : command) {
    replace_all(word, "{scenario}", scenario);
    replace_all(word, "{seed}", std::to_string(run.seed));
    replace_all(word, "{output}", output);
  }
  return command;
}

std::string Campaign::repeating_command(std::size_t number) const {
  const fs::path folder = fs::absolute(run_folder(number));
  std::string line;
  for (const std::string& word :
       command_of(plan_.runs[number], (folder / "scenario.yaml").string(), "again")) {
    line += (line.empty() ? "" : " ") + shell_word(word);
  }
  if (!study_.command.empty()) {  // it runs in the study's folder, and its output is there
    const fs::path home = fs::absolute(study_.path).parent_path();
    line = fmt::format("cd {} && mkdir -p again && {}", shell_word(home.string()), line);
  }
  return line;
}

std::optional<RunRecord> Campaign::fly(std::size_t number, const std::atomic<bool>& stop) const {
  const PlannedRun& run = plan_.runs[number];
  const Folder home(fs::absolute(folder_).string());
  Attempt attempt(home, number);
  OwnedFolder& folder = attempt.folder();
  Scenario scenario;
  std::string text;
  try {
    text = scenario_text_of(run);
    scenario = parse_scenario(text, scenario_path_);
  } catch (const InputError& problem) {  // values that fit the scenario one by one
    RunRecord record;
    record.status = RunStatus::kFailed;
    record.reason = "values that do not fit together";
    if (!text.empty()) write_text(folder.file("scenario.yaml"), text);
    write_text(folder.file("log.txt"), std::string(problem.what()) + "\n");
    attempt.keep(record);
    return record;
  }
  const auto known = map_hashes_.find(scenario.map_name());
  std::string map_hash;
  if (known != map_hashes_.end()) {
    map_hash = known->second;
  } else if (!scenario.world) {
    map_hash = scenario.open_map()->hash();
  }
  write_scenario_copy(scenario, map_hash, folder, run_folder(number));
  const std::string output = folder.path() + "/" + kFlightOutput;
  if (!folder.folder().make(kFlightOutput)) {
    throw InputError(fmt::format("{}: cannot make the folder", output));
  }
  ProcessRequest request;
  request.command = command_of(run, folder.path() + "/scenario.yaml", output);
  request.log = folder.file("log.txt");
  request.folder = fs::path(study_.path).parent_path().string();
  request.time_limit = study_.time_limit;
  request.memory_limit = study_.memory_limit;
  const ProcessResult ended = run_process(request, stop);
  // killed from outside, as by an operator or a batch system: no result of the run's own; `fly`
  // takes SIGTERM and says so
  constexpr int kFlyInterrupted = 130;
  const bool was_killed = ended.signal == SIGKILL || ended.signal == SIGTERM ||
                          (study_.command.empty() && ended.exit_code == kFlyInterrupted);
  if (!ended.timed_out && (ended.interrupted || was_killed || stop)) return std::nullopt;
  RunRecord record;
  judge(ended, study_, record);
  try {
    read_results(output, study_.figures, record);
  } catch (const InputError& problem) {
    record.status = RunStatus::kFailed;
    record.reason = "results that cannot be read";
    write_text(folder.file("results_error.txt"), std::string(problem.what()) + "\n");
  }
  if (study_.kept == KeptFiles::kResults) attempt.remove_bulk(study_.figures);
  attempt.keep(record);
  return record;
}

}  // namespace pointflight
