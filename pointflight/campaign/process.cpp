#include "pointflight/campaign/process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <optional>
#include <system_error>
#include <thread>

#include "pointflight/core/child_process.hpp"
#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kGrace = std::chrono::seconds(5);  // from SIGTERM to SIGKILL
constexpr int kLook = 100;                        // ms between looks at `stop`

/// A descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return number_; }

 private:
  int number_;
};

std::string reason(int error) {
  return std::generic_category().message(error);
}

/// What a child does between fork and exec: calls that are safe beside other threads, and no more.
struct Start {
  const char* program;
  char* const* arguments;
  const char* folder;
  int log, errors, null, failure;
  double memory_limit;
  pid_t parent;
};

[[noreturn]] void become(const Start& start) {
  const auto fail = [&](int error) {
    static_cast<void>(!write(start.failure, &error, sizeof(error)));
    _exit(127);
  };
  setpgid(0, 0);
  // it is not to outlive who would take its results
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != start.parent) _exit(127);
  restore_default_signals();
  if (start.memory_limit > 0.0) {
    const auto bytes = static_cast<rlim_t>(start.memory_limit);
    const rlimit limit{bytes, bytes};
    setrlimit(RLIMIT_DATA, &limit);
  }
  if (start.folder[0] != '\0' && chdir(start.folder) != 0) fail(errno);
  dup2(start.null, STDIN_FILENO);
  dup2(start.log, STDOUT_FILENO);
  dup2(start.errors, STDERR_FILENO);
  execv(start.program, start.arguments);
  fail(errno);
  _exit(127);
}

/// Along PATH, as a shell would find it; as it is where it has a slash.
std::string found_program(const std::string& name) {
  if (name.find('/') != std::string::npos) return name;
  const char* path = std::getenv("PATH");  // NOLINT(concurrency-mt-unsafe): nobody sets it here
  std::string rest = path != nullptr ? path : "/usr/local/bin:/usr/bin:/bin";
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(':'), rest.size());
    const std::string candidate = rest.substr(0, end) + "/" + name;
    if (access(candidate.c_str(), X_OK) == 0) return candidate;
    rest.erase(0, end + 1);
  }
  throw InputError(fmt::format("{}: there is no such program", name));
}

int opened_log(const std::string& path) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0644);
  if (file < 0) throw InputError(fmt::format("{}: {}", path, reason(errno)));
  return file;
}

pid_t start_process(const ProcessRequest& request) {
  const std::string program = found_program(request.command.front());
  std::vector<char*> arguments;
  arguments.reserve(request.command.size() + 1);
  for (const std::string& word : request.command)
    arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const Descriptor log_file(opened_log(request.log));
  const Descriptor error_file(request.errors.empty() ? -1 : opened_log(request.errors));
  const Descriptor null(open("/dev/null", O_RDONLY | O_CLOEXEC));
  std::array<int, 2> ends = {-1, -1};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw InputError(fmt::format("no pipe for a process: {}", reason(errno)));
  }
  const Descriptor read_end(ends[0]);
  auto write_end = std::make_optional<Descriptor>(ends[1]);
  const Start start{program.c_str(),
                    arguments.data(),
                    request.folder.c_str(),
                    log_file.get(),
                    request.errors.empty() ? log_file.get() : error_file.get(),
                    null.get(),
                    ends[1],
                    request.memory_limit,
                    getpid()};
  const pid_t child = fork();
  if (child == 0) become(start);
  if (child < 0) {
    throw InputError(fmt::format(
        "no process for a run: {}; give fewer --jobs, or allow more (ulimit -u)", reason(errno)));
  }
  setpgid(child, child);  // whoever comes first
  write_end.reset();
  int error = 0;
  ssize_t got = 0;
  while ((got = read(read_end.get(), &error, sizeof(error))) < 0 && errno == EINTR) {
  }
  if (got == sizeof(error)) {
    waitpid(child, nullptr, 0);
    throw InputError(fmt::format("{}: {}", request.command.front(), reason(error)));
  }
  return child;
}

}  // namespace

ProcessResult run_process(const ProcessRequest& request, const std::atomic<bool>& stop) {
  const Clock::time_point begin = Clock::now();
  const pid_t child = start_process(request);
  const Descriptor handle(static_cast<int>(syscall(SYS_pidfd_open, child, 0)));
  ProcessResult result;
  std::optional<Clock::time_point> told;  // when it was told to end
  bool killed = false;
  for (;;) {
    pollfd poll_handle{handle.get(), POLLIN, 0};
    if (handle.get() >= 0) {
      poll(&poll_handle, 1, kLook);
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));  // a kernel before 5.3
    }
    int status = 0;
    const pid_t ended = waitpid(child, &status, WNOHANG);
    if (ended == child) {
      if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
      if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
      break;
    }
    if (ended < 0 && errno == ECHILD) break;  // the kernel took it if SIGCHLD is ignored
    const Clock::time_point now = Clock::now();
    const std::chrono::duration<double> taken = now - begin;
    const bool is_late = request.time_limit > 0.0 && taken.count() > request.time_limit;
    if (!told && (is_late || stop)) {
      (is_late ? result.timed_out : result.interrupted) = true;
      told = now;
      kill(-child, SIGTERM);
    } else if (told && !killed && now - *told > kGrace) {
      killed = true;
      kill(-child, SIGKILL);
    }
  }
  kill(-child, SIGKILL);  // what it left behind
  result.wall_seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  return result;
}

}  // namespace pointflight
