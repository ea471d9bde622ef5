#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>
#include <thread>

#include "pointflight/campaign/engines.hpp"
#include "pointflight/campaign/process.hpp"
#include "pointflight/core/folder.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/core/shell_words.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostTasks = 100;
constexpr auto kAskBetween = std::chrono::seconds(2);

struct Answer {
  int exit_code = 0;
  std::string text;
  std::string errors;  ///< And warnings: clusters' plugins say all kinds of things.
};

/// What a command of Slurm's says.
Answer ask(const Folder& folder,
           const std::vector<std::string>& command,
           const std::atomic<bool>& stop) {
  ProcessRequest request;
  request.command = command;
  const std::string log = Folder::temporary_name(command.front());
  const std::string errors = Folder::temporary_name(command.front() + ".errors");
  request.log = folder.path() + "/" + log;
  request.errors = folder.path() + "/" + errors;
  request.time_limit = 120.0;
  const ProcessResult ended = run_process(request, stop);
  Answer answer{ended.timed_out ? -1 : ended.exit_code, {}, {}};
  answer.text = MappedFile(request.log).text();
  answer.errors = MappedFile(request.errors).text();
  folder.remove_file(log);
  folder.remove_file(errors);
  return answer;
}

std::string reason_of(const Answer& answer) {
  const std::string& text = answer.errors.empty() ? answer.text : answer.errors;
  return text.substr(0, text.find('\n'));
}

std::string first_line(const std::string& text) {
  return text.substr(0, text.find('\n'));
}

bool is_job(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
}

/// True while some of its tasks wait or run. A job that Slurm has forgotten is over; a controller
/// that does not answer for a while is asked again.
bool is_there(const Folder& folder, const std::string& job, const std::atomic<bool>& stop) {
  for (int tries = 0;; ++tries) {
    const Answer answer =
        ask(folder, {"squeue", "--noheader", "--format=%T", "--jobs=" + job}, stop);
    if (stop) return true;  // nobody knows
    if (answer.exit_code == 0) {
      return answer.text.find_first_not_of(" \t\r\n") != std::string::npos;
    }
    if (answer.errors.find("Invalid job id") != std::string::npos) return false;
    constexpr int kMostTries = 30;
    if (tries == kMostTries) throw InputError(fmt::format("squeue: {}", reason_of(answer)));
    std::this_thread::sleep_for(kAskBetween);
  }
}

std::string submit(const Campaign& campaign,
                   const Folder& folder,
                   const std::vector<std::size_t>& numbers,
                   const SlurmOptions& options) {
  const std::size_t count = numbers.size();
  const std::size_t tasks = even_shares(
      numbers, std::min(count, options.tasks > 0 ? options.tasks : std::min(count, kMostTasks)));
  const auto word = [](const std::string& path) { return shell_word(fs::absolute(path).string()); };
  std::vector<std::string> command = {
      "sbatch",
      "--parsable",
      "--job-name=pointflight",
      fmt::format("--array=0-{}", tasks - 1),
      "--output=" + folder.path() + "/task_%a.log",
      "--chdir=" + fs::absolute(campaign.study().path).parent_path().string()};
  command.insert(command.end(), options.words.begin(), options.words.end());
  command.push_back(fmt::format("--wrap=exec {} campaign {} -o {} --share $SLURM_ARRAY_TASK_ID/{}",
                                word(options.program),
                                word(campaign.study().path),
                                word(campaign.folder()),
                                tasks));
  const std::atomic<bool> never = false;  // a job that nobody knows of would be the worse end
  const Answer answer = ask(folder, command, never);
  // "123" or "123;cluster"
  const std::string job = first_line(answer.text).substr(0, answer.text.find_first_of(";\n"));
  if (answer.exit_code != 0 || !is_job(job)) {
    throw InputError(fmt::format("sbatch: {}", reason_of(answer)));
  }
  return job;
}

std::optional<std::string> job_in(const fs::path& file) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return std::nullopt;
  const std::string job = first_line(std::string(MappedFile(file.string()).text()));
  return is_job(job) ? std::optional(job) : std::nullopt;
}

}  // namespace

std::string fly_by_slurm(const Campaign& campaign,
                         const std::vector<std::size_t>& numbers,
                         const SlurmOptions& options,
                         const std::atomic<bool>& stop,
                         const Progress& progress) {
  const Folder home(fs::absolute(campaign.folder()).string());
  const auto made = home.make("slurm");
  if (!made) {
    throw InputError(fmt::format(
        "{}/slurm: cannot be used as a folder: it is a link, a file, a mount or not writable",
        home.path()));
  }
  const Folder& folder = *made;
  const fs::path note = fs::path(folder.path()) / "job";
  std::optional<std::string> job = job_in(note);
  if (!job || !is_there(folder, *job, stop)) {
    job = submit(campaign, folder, numbers, options);
    OutputFile file(note.string());
    file.write(*job + "\n");
    file.commit();
  }
  while (!stop && is_there(folder, *job, stop)) {
    const auto left = static_cast<double>(campaign.missing().size());
    const auto all = static_cast<double>(campaign.plan().runs.size());
    report(progress, fmt::format("Slurm's job {}", *job), 1.0 - left / all);
    std::this_thread::sleep_for(kAskBetween);
  }
  return fmt::format("job {}", *job);
}

}  // namespace pointflight
