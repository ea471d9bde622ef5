#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "apps/campaign_results.hpp"
#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/input_kind.hpp"
#include "apps/modules.hpp"
#include "apps/terminal.hpp"
#include "pointflight/campaign/campaign.hpp"
#include "pointflight/campaign/engines.hpp"
#include "pointflight/campaign/mpi_module.hpp"
#include "pointflight/campaign/statistics.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/locked_file.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

struct CampaignFlags {
  std::string study;
  std::string folder;
  std::string engine = "local";
  int jobs = 0;
  std::string share;
  std::size_t tasks = 0;
  std::vector<std::string> slurm;
  std::vector<std::string> fail_if;
  bool retry = false;
  bool json = false;
};

std::string own_program() {
  std::error_code error;
  return fs::read_symlink("/proc/self/exe", error).string();
}

int jobs_of(const CampaignFlags& flags) {
  if (flags.jobs > 0) return flags.jobs;
  // a worker has what its batch system gave it
  if (!flags.share.empty()) return 1;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

/// Sets `stop` once a signal came, as long as it lives.
class StopWatch {
 public:
  /// `has_limit`: flights end by themselves after a time.
  explicit StopWatch(bool has_limit) : says_waiting_(!has_limit) {
    catch_interrupts();
    thread_ = std::thread([this] {
      while (!over_) {
        if (interrupted()) stop_ = true;
        say_waiting();
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
    });
  }
  ~StopWatch() {
    over_ = true;
    thread_.join();
  }
  StopWatch(const StopWatch&) = delete;
  StopWatch& operator=(const StopWatch&) = delete;
  [[nodiscard]] const std::atomic<bool>& stop() const { return stop_; }
  /// A flight has ended.
  void note_flight() { flown_ = Clock::now(); }

 private:
  using Clock = std::chrono::steady_clock;
  /// A program that waits for something, a lock say, would do so unseen.
  void say_waiting() {
    constexpr auto kLong = std::chrono::minutes(2);
    if (!says_waiting_ || Clock::now() - flown_.load() < kLong) return;
    says_waiting_ = false;
    log("no flight has ended for two minutes; those that never do are ended by `limits: {time: "
        "SECONDS}` in the study (said once)");
  }

  std::atomic<Clock::time_point> flown_ = Clock::now();
  bool says_waiting_;
  std::atomic<bool> stop_ = false;
  std::atomic<bool> over_ = false;
  std::thread thread_;
};

/// Says how far it is: so many of `all` are done already. With `others` flying them too the folder
/// is asked, now and then.
FlightDone teller(
    const Campaign& campaign, std::size_t done, std::size_t all, bool others, StopWatch* watch) {
  using Clock = std::chrono::steady_clock;
  struct Count {
    std::size_t done = 0, failed = 0;
    Clock::time_point asked{};
    Progress progress = terminal_progress();
  };
  auto count = std::make_shared<Count>();
  count->done = done;
  return [&campaign, count, all, others, watch](std::size_t /*number*/, const RunRecord& record) {
    ++count->done;
    if (watch != nullptr) watch->note_flight();
    if (others && Clock::now() - count->asked > std::chrono::seconds(2)) {
      count->asked = Clock::now();
      count->done = all - campaign.missing().size();
    }
    count->failed += record.status == RunStatus::kFailed ? 1 : 0;
    const std::string what =
        count->failed == 0 ? "flying" : fmt::format("flying, {} failed", count->failed);
    report(count->progress, what, static_cast<double>(count->done) / static_cast<double>(all));
  };
}

Results results_of(const Campaign& campaign) {
  Results results;
  for (const PlannedRun& run : campaign.plan().runs) {
    if (auto record = campaign.result(run.number)) results.emplace(run.number, std::move(*record));
  }
  return results;
}

/// What came of all, and the exit code.
int finish(const Campaign& campaign,
           const CampaignFlags& flags,
           const std::vector<Condition>& conditions,
           bool was_stopped) {
  const Results results = results_of(campaign);
  end_progress();
  const std::vector<FailedRun> failed = failed_of(campaign, results);
  write_results(campaign, results, failed);
  print_results(campaign, results, failed, flags.json);
  const std::size_t left = campaign.plan().runs.size() - results.size();
  if (left > 0) {
    std::string why = "it was ended";
    if (!was_stopped && flags.engine == "slurm") {
      why = fmt::format("their tasks have ended; what these said: {}/slurm", campaign.folder());
    } else if (!was_stopped) {
      why =
          "somebody outside killed them: a batch system, or the system for want of memory, which "
          "limits: {memory} would have made a failure of";
    }
    log(fmt::format("{} flights are left ({}); the same command goes on", left, why));
    return was_stopped ? kInterrupted : kWrongInput;
  }
  int code = kDone;
  for (const Condition& condition : conditions) {
    const double value = condition.value(all_of(results));
    if (!condition.holds(all_of(results))) continue;
    log(fmt::format("--fail-if {}: it is {:.6g}", condition.text(), value));
    code = kRanButFailed;
  }
  return code;
}

/// What attempts left that were killed.
void clear(const Campaign& campaign) {
  const std::size_t left = campaign.remove_leftovers();
  if (left == 0) return;
  log(fmt::format(
      "{} interrupted flights left files of your program in {}/runs/*.attempt-*; they stay until "
      "you remove them",
      left,
      campaign.folder()));
}

/// A worker's part: no tables, and nobody is kept out.
int fly_share(const Campaign& campaign, const CampaignFlags& flags) {
  StopWatch watch(campaign.study().time_limit > 0.0);
  const auto own = share_of(campaign.missing(), parse_share(flags.share));
  fly_here(
      campaign, own, jobs_of(flags), watch.stop(), teller(campaign, 0, own.size(), false, &watch));
  end_progress();
  return watch.stop() ? kInterrupted : kDone;
}

/// With Slurm's or our own processes; one coordinator for a folder.
int coordinate(Campaign& campaign,
               const CampaignFlags& flags,
               const std::vector<Condition>& conditions) {
  const FolderLock lock(campaign.folder());
  StopWatch watch(campaign.study().time_limit > 0.0 || flags.engine == "slurm");
  clear(campaign);
  if (flags.retry) campaign.forget_failed();
  const std::vector<std::size_t> missing = campaign.missing();
  if (!missing.empty() && flags.engine == "slurm") {
    SlurmOptions options;
    options.tasks = flags.tasks;
    options.program = own_program();
    for (const std::string& words : flags.slurm) {
      std::istringstream split(words);
      for (std::string word; split >> word;) options.words.push_back(word);
    }
    const std::string job =
        fly_by_slurm(campaign, missing, options, watch.stop(), terminal_progress());
    if (watch.stop()) {
      end_progress();
      log(fmt::format("{} goes on without this; the same command waits for it", job));
      return kInterrupted;
    }
  } else if (!missing.empty()) {
    const std::size_t all = campaign.plan().runs.size();
    fly_here(campaign,
             missing,
             jobs_of(flags),
             watch.stop(),
             teller(campaign, all - missing.size(), all, false, &watch));
  }
  return finish(campaign, flags, conditions, watch.stop());
}

/// All ranks fly what rank 0 deals out; it alone keeps the folder and gathers.
int fly_by_mpi(const CampaignFlags& flags, const std::vector<Condition>& conditions) {
  const MpiModule& mpi = mpi_module();
  mpi.begin();
  const bool is_first = mpi.rank() == 0;
  std::optional<Campaign> campaign;
  std::optional<FolderLock> lock;
  if (is_first) {
    campaign.emplace(load_study(flags.study), flags.folder, own_program());
    lock.emplace(flags.folder);
    clear(*campaign);
    if (flags.retry) campaign->forget_failed();
  }
  mpi.barrier();  // the folder is there
  if (!is_first) campaign.emplace(load_study(flags.study), flags.folder, own_program());
  const std::vector<std::size_t> missing = campaign->missing();
  mpi.barrier();  // nobody flies while others look what is missing
  StopWatch watch(true);
  const std::size_t all = campaign->plan().runs.size();
  const FlightDone done =
      is_first ? teller(*campaign, all - missing.size(), all, true, nullptr) : FlightDone();
  for (std::size_t i = 0; !watch.stop() && (i = mpi.next()) < missing.size();) {
    const auto record = campaign->fly(missing[i], watch.stop());
    if (record && done) done(missing[i], *record);
  }
  mpi.barrier();
  const int code = is_first ? finish(*campaign, flags, conditions, watch.stop()) : int{kDone};
  mpi.end();
  return code;
}

/// Flags that would do nothing are mistakes.
void check_flags(const CampaignFlags& flags) {
  if (flags.folder.empty()) throw InputError("-o: the folder of the results has no name");
  const bool is_worker = !flags.share.empty();
  if (flags.engine != "slurm" && (flags.tasks > 0 || !flags.slurm.empty())) {
    throw InputError("--tasks and --slurm go with --engine slurm");
  }
  if (flags.engine != "local" && flags.jobs > 0) {
    throw InputError("--jobs is for flights on this machine: Slurm and mpirun have their own ways");
  }
  if (is_worker && (flags.retry || flags.json || !flags.fail_if.empty())) {
    throw InputError("--share flies only; --fail-if, --retry-failed and --json go without it");
  }
  if (is_worker) parse_share(flags.share);  // before there is a folder
}

int run_campaign(const CampaignFlags& flags) {
  check_flags(flags);
  require_kind(flags.study, {InputKind::kYaml}, "a study (.yaml)");
  std::signal(SIGCHLD, SIG_DFL);  // whoever started us may ignore it: no child's end would be known
  std::vector<Condition> conditions;
  for (const std::string& text : flags.fail_if) conditions.emplace_back(text);
  if (flags.engine == "mpi") return fly_by_mpi(flags, conditions);
  Campaign campaign(load_study(flags.study), flags.folder, own_program());
  return flags.share.empty() ? coordinate(campaign, flags, conditions) : fly_share(campaign, flags);
}

}  // namespace

void add_campaign_command(CLI::App& parent, int& exit_code) {
  auto* app = parent.add_subcommand(
      "campaign",
      "Fly a study: seeds and values of a scenario's keys, with a table, plots and a verdict");
  auto flags = std::make_shared<CampaignFlags>();
  app->add_option("study", flags->study, "STUDY.yaml: scenario, seeds, grid, draws, command")
      ->required()
      ->check(CLI::ExistingFile);
  app->add_option("-o,--output",
                  flags->folder,
                  "Folder of its flights and results; one that is there already goes on")
      ->required();
  auto* engine =
      app->add_option("--engine",
                      flags->engine,
                      "Who flies: local (processes here), slurm (a job array by sbatch), "
                      "mpi (mpirun pointflight campaign ... --engine mpi)")
          ->check(CLI::IsMember({"local", "slurm", "mpi"}));
  app->add_option("--jobs", flags->jobs, "Flights at once on this machine; 0: as many as cores")
      ->check(CLI::Range(0, 4096));
  app->add_option("--share",
                  flags->share,
                  "K/N: only flights K, K + N, K + 2 N, ... and no tables: a worker of any other "
                  "batch system")
      ->excludes(engine);
  app->add_option("--tasks", flags->tasks, "Of Slurm's job array; 0: one per flight, at most 100")
      ->check(CLI::Range(0, 100000));
  app->add_option(
      "--slurm", flags->slurm, "Options for sbatch: --slurm \"--partition=short --time=60\"");
  app->add_option("--fail-if",
                  flags->fail_if,
                  "Exit code 1 if it holds: \"collision_rate > 0.02\", \"min(closest_approach) < "
                  "0.2\"; again for more");
  app->add_flag("--retry-failed", flags->retry, "Fly those again that failed");
  app->add_flag("--json", flags->json, "For programs");
  app->footer(
      "Example: pointflight campaign study.yaml -o results --fail-if \"collision_rate > 0.02\"");
  app->callback([flags, &exit_code] { exit_code = run_campaign(*flags); });
}

}  // namespace pointflight::apps
