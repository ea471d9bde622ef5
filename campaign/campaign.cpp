#include "campaign/campaign.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "campaign/process.hpp"
#include "pointflight/core/hash.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/locked_file.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/core/shell_words.hpp"
#include "pointflight/core/version.hpp"
#include "pointflight/sim/scenario.hpp"
#include "pointflight/sim/scenario_copy.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

constexpr const char* kResult = "result.json";
constexpr const char* kAttempt = ".attempt-";

void write_text(const fs::path& path, std::string_view text) {
  OutputFile file(path.string());
  file.write(text);
  file.commit();
}

std::string host_name() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return "host";
  return name.data();
}

/// A folder of this attempt's own: the name says whose it is.
fs::path make_attempt(const fs::path& run) {
  static std::atomic<int> count = 0;
  const std::string name =
      fmt::format("{}{}{}-{}-{}", run.string(), kAttempt, host_name(), getpid(), ++count);
  std::error_code error;
  fs::remove_all(name, error);
  if (!fs::create_directories(name, error) && error) {
    throw InputError(fmt::format("{}: {}", name, error.message()));
  }
  return name;
}

/// The attempt is over: it gets the run's name.
void keep(const fs::path& attempt, const fs::path& final_folder, const RunRecord& record) {
  write_text(attempt / kResult, record_json(record));
  std::error_code error;
  // what has no result is none: half taken away
  if (!fs::exists(final_folder / kResult, error)) fs::remove_all(final_folder, error);
  fs::rename(attempt, final_folder, error);
  if (error && !fs::exists(final_folder)) {  // else somebody else has flown it meanwhile: the same
    throw InputError(fmt::format("{}: {}", final_folder.string(), error.message()));
  }
}

/// An attempt that ends without a result leaves nothing.
class AttemptGuard {
 public:
  explicit AttemptGuard(fs::path folder) : folder_(std::move(folder)) {}
  ~AttemptGuard() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  AttemptGuard(const AttemptGuard&) = delete;
  AttemptGuard& operator=(const AttemptGuard&) = delete;

 private:
  fs::path folder_;
};

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
  std::shared_ptr<const SurfelMap>& map = maps_[scenario.map];
  if (!map) map = scenario.open_map();
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
    for (const std::string& end : ends_of(draw)) check(draw.key, end, draw.line);
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
  for (const auto& [path, map] : maps_) maps += map->hash() + "\n";
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
  const fs::path runs = fs::path(folder_) / "runs";
  const std::string path = (fs::path(folder_) / "campaign.json").string();
  const bool is_one = fs::exists(path, error) || fs::exists(runs, error);
  if (!is_one && fs::exists(folder_, error) && !fs::is_empty(folder_, error)) {
    throw InputError(
        fmt::format("{}: is not empty, and no campaign; choose another folder", folder_));
  }
  fs::create_directories(runs, error);
  if (error) throw InputError(fmt::format("{}: {}", folder_, error.message()));
  if (fs::exists(path, error)) {
    if (MappedFile(path).text() == identity()) return;
    throw InputError(fmt::format(
        "{}: is the campaign of another study, scenario, map, input or version; choose another "
        "folder",
        folder_));
  }
  const std::string own = fmt::format("{}.{}-{}", path, host_name(), getpid());
  write_text(own, identity());
  fs::rename(own, path, error);
  if (error) throw InputError(fmt::format("{}: {}", path, error.message()));
}

std::string Campaign::run_folder(std::size_t number) const {
  return (fs::path(folder_) / "runs" / fmt::format("{:06}", number)).string();
}

std::vector<std::size_t> Campaign::missing() const {
  std::set<std::string> there;
  std::error_code error;
  for (fs::directory_iterator at(fs::path(folder_) / "runs", error);
       !error && at != fs::directory_iterator();
       at.increment(error)) {
    std::error_code ignored;
    const bool is_over = fs::exists(at->path() / kResult, ignored);
    if (is_over) there.insert(at->path().filename().string());
  }
  std::vector<std::size_t> missing;
  for (const PlannedRun& run : plan_.runs) {
    if (!there.contains(fmt::format("{:06}", run.number))) missing.push_back(run.number);
  }
  return missing;
}

std::size_t Campaign::forget_failed() {
  std::size_t count = 0;
  for (const PlannedRun& run : plan_.runs) {
    const auto record = result(run.number);
    if (!record || record->status != RunStatus::kFailed) continue;
    // at one stroke: whoever is killed meanwhile leaves no half of a result
    std::error_code error;
    fs::remove(fs::path(run_folder(run.number)) / kResult, error);
    if (error) throw InputError(fmt::format("{}: {}", run_folder(run.number), error.message()));
    fs::remove_all(run_folder(run.number), error);
    ++count;
  }
  return count;
}

void Campaign::remove_leftovers() const {
  const std::string ours = kAttempt + host_name() + "-";
  std::error_code error;
  for (fs::directory_iterator at(fs::path(folder_) / "runs", error);
       !error && at != fs::directory_iterator();
       at.increment(error)) {
    const std::string name = at->path().filename().string();
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
    if (pid <= 0 || pid == getpid()) continue;
    if (kill(static_cast<pid_t>(pid), 0) == 0 || errno != ESRCH) continue;
    try {
      // containers have process numbers of their own: whoever flies there holds the folder
      const FolderLock lock(at->path().string());
      std::error_code ignored;
      fs::remove_all(at->path(), ignored);
    } catch (const InputError&) {  // somebody flies there
    }
  }
}

std::optional<RunRecord> Campaign::result(std::size_t number) const {
  const fs::path path = fs::path(run_folder(number)) / kResult;
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

/// What a thousand runs need not keep.
void Campaign::remove_bulk(const std::string& output) const {
  if (study_.kept == KeptFiles::kAll) return;
  const std::set<std::string> kept = {"summary.json", "timing.json", "events.csv", study_.figures};
  std::error_code ignored;
  std::vector<fs::path> others;
  for (fs::directory_iterator at(output, ignored); !ignored && at != fs::directory_iterator();
       at.increment(ignored)) {
    if (!kept.contains(at->path().filename().string())) others.push_back(at->path());
  }
  for (const fs::path& path : others) fs::remove_all(path, ignored);
}

std::optional<RunRecord> Campaign::fly(std::size_t number, const std::atomic<bool>& stop) const {
  const PlannedRun& run = plan_.runs[number];
  const fs::path final_folder = run_folder(number);
  const fs::path attempt = fs::absolute(make_attempt(final_folder));
  const AttemptGuard guard(attempt);
  const FolderLock lock(attempt.string());
  Scenario scenario;
  std::string text;
  try {
    text = scenario_text_of(run);
    scenario = parse_scenario(text, scenario_path_);
  } catch (const InputError& problem) {  // values that fit the scenario one by one
    RunRecord record;
    record.status = RunStatus::kFailed;
    record.reason = "values that do not fit together";
    if (!text.empty()) write_text(attempt / "scenario.yaml", text);
    write_text(attempt / "log.txt", std::string(problem.what()) + "\n");
    keep(attempt, final_folder, record);
    return record;
  }
  const auto map = maps_.find(scenario.map);
  write_scenario_copy(scenario,
                      map != maps_.end() ? *map->second : *scenario.open_map(),
                      attempt.string(),
                      final_folder.string());
  const std::string output = (attempt / "output").string();
  std::error_code error;
  fs::create_directory(output, error);
  ProcessRequest request;
  request.command = command_of(run, (attempt / "scenario.yaml").string(), output);
  request.log = (attempt / "log.txt").string();
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
    write_text(attempt / "results_error.txt", std::string(problem.what()) + "\n");
  }
  remove_bulk(output);
  keep(attempt, final_folder, record);
  return record;
}

}  // namespace pointflight
