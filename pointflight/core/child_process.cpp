#include "pointflight/core/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <exception>
#include <new>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kShadowed = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || \
    __has_feature(memory_sanitizer)
constexpr bool kShadowed = true;
#else
constexpr bool kShadowed = false;
#endif
#else
constexpr bool kShadowed = false;
#endif

/// What the child says, one after another: a kind and a length, then bytes.
enum class Record : std::uint64_t { kBytes, kFailure, kDone };
struct RecordHeader {
  Record record;
  std::uint64_t size;
};

constexpr int kPollMilliseconds = 100;

// ---- in the child ----

/// A pipe whose reader has gone ends the child: nobody waits for it.
void write_all(int pipe, const std::byte* bytes, std::size_t size) {
  while (size > 0) {
    const ssize_t written = ::write(pipe, bytes, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) ::_exit(1);
    bytes += written;
    size -= static_cast<std::size_t>(written);
  }
}

void write_record(int pipe, Record record, std::span<const std::byte> bytes) {
  const RecordHeader header{record, bytes.size()};
  write_all(pipe, reinterpret_cast<const std::byte*>(&header), sizeof header);
  write_all(pipe, bytes.data(), bytes.size());
}

void write_text(int pipe, Record record, std::string_view text) {
  write_record(pipe, record, std::as_bytes(std::span<const char>(text.data(), text.size())));
}

void set_limit(decltype(RLIMIT_CORE) resource, rlim_t soft, rlim_t hard) {
  struct rlimit limit {};
  if (::getrlimit(resource, &limit) != 0) return;
  limit.rlim_max = std::min(limit.rlim_max, hard);
  limit.rlim_cur = std::min(limit.rlim_max, soft);
  ::setrlimit(resource, &limit);
}

/// Bytes of the address space in use: what is mapped counts against its limit.
std::optional<std::size_t> address_space_in_use() {
  const int file = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  std::array<char, 64> text{};
  const ssize_t size = ::read(file, text.data(), text.size() - 1);
  ::close(file);
  const unsigned long long pages = size > 0 ? std::strtoull(text.data(), nullptr, 10) : 0;
  if (pages == 0) return std::nullopt;
  return static_cast<std::size_t>(pages) * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

void restrict_child(const ChildLimits& limits, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(1);  // it ended before the line above
  ::prctl(PR_SET_DUMPABLE, 0);            // no core file, whatever core_pattern says
  restore_default_signals();
  set_limit(RLIMIT_CORE, 0, 0);
  const auto seconds = static_cast<rlim_t>(std::ceil(std::max(1.0, limits.cpu_seconds)));
  set_limit(RLIMIT_CPU, seconds, seconds + 1);  // SIGXCPU, then SIGKILL
  if (!kShadowed) {
    if (const auto used = address_space_in_use()) {
      set_limit(RLIMIT_AS, *used + limits.memory_bytes, *used + limits.memory_bytes);
    }
  }
  // what a library prints as it dies is no line of ours
  const int null = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (null >= 0) ::dup2(null, stream);
  }
}

[[noreturn]] void run_child(const std::function<void(ChildOutput&)>& work,
                            const ChildLimits& limits,
                            pid_t parent,
                            int pipe) {
  // a pipe on the number of a standard stream would be lost
  const int output = ::fcntl(pipe, F_DUPFD_CLOEXEC, 3);
  if (output < 0) ::_exit(1);
  restrict_child(limits, parent);
  try {
    ChildOutput to_parent(output);
    work(to_parent);
    write_text(output, Record::kDone, {});
  } catch (const std::bad_alloc&) {
    write_text(output, Record::kFailure, kTooMuchMemory);
  } catch (const std::exception& error) {
    write_text(output, Record::kFailure, error.what());
  } catch (...) {
    write_text(output, Record::kFailure, "unknown");
  }
  ::_exit(0);
}

// ---- in the parent ----

std::string reason_of(int status, const ChildLimits& limits) {
  if (!WIFSIGNALED(status)) return "it ended early";
  const int signal = WTERMSIG(status);
  if (signal == SIGXCPU || signal == SIGKILL) {
    return fmt::format("it was ended: it took more than {:.0f} s or too much memory",
                       std::max(1.0, limits.cpu_seconds));
  }
  const char* name = ::sigabbrev_np(signal);
  return fmt::format("it crashed (SIG{})", name == nullptr ? "?" : name);
}

/// A running child; ended with this at the latest.
class Child {
 public:
  Child(pid_t id, int pipe) : id_(id), pipe_(pipe) {}
  ~Child() {
    ::close(pipe_);
    if (ended_) return;
    ::kill(id_, SIGKILL);
    wait(0);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  [[nodiscard]] int pipe() const { return pipe_; }
  [[nodiscard]] int status() const { return status_; }

  /// True once it has ended; if the program ignores SIGCHLD or waits for it elsewhere, how it
  /// ended is not known.
  bool wait(int flags) {
    while (!ended_) {
      const pid_t got = ::waitpid(id_, &status_, flags);
      if (got < 0 && errno == EINTR) continue;
      if (got == 0) return false;
      ended_ = true;
    }
    return true;
  }

 private:
  pid_t id_;
  int pipe_;
  int status_ = 0;
  bool ended_ = false;
};

/// Takes records off the front of what the child said.
class RecordReader {
 public:
  /// True when nothing more will come.
  bool add(std::span<const std::byte> bytes, ChildResult& result) {
    while (!bytes.empty()) {
      if (left_ == 0) {
        const std::size_t count = std::min(bytes.size(), sizeof header_ - header_size_);
        std::memcpy(reinterpret_cast<std::byte*>(&header_) + header_size_, bytes.data(), count);
        header_size_ += count;
        bytes = bytes.subspan(count);
        if (header_size_ < sizeof header_) return false;
        header_size_ = 0;
        left_ = header_.size;
        if (header_.record == Record::kDone) {
          done_ = true;
          return true;
        }
      }
      const auto part = bytes.first(std::min<std::uint64_t>(bytes.size(), left_));
      if (header_.record == Record::kFailure) {
        result.failure.append(reinterpret_cast<const char*>(part.data()), part.size());
      } else {
        result.bytes.insert(result.bytes.end(), part.begin(), part.end());
      }
      left_ -= part.size();
      bytes = bytes.subspan(part.size());
    }
    return false;
  }
  [[nodiscard]] bool done() const { return done_; }

 private:
  RecordHeader header_{};
  std::size_t header_size_ = 0;
  std::uint64_t left_ = 0;
  bool done_ = false;
};

[[noreturn]] void fail_to_start(const char* what, int error) {
  throw InputError(
      fmt::format("no {}: {}; close other programs", what, std::generic_category().message(error)));
}

ChildResult listen(Child& child,
                   const ChildLimits& limits,
                   const std::function<void()>& while_waiting) {
  ChildResult result;
  RecordReader reader;
  std::vector<std::byte> buffer(1 << 16);
  // a child that sleeps uses no time of the processor: polls without a word from it are a clock
  const auto most_polls = static_cast<int>(
      std::min(1e6, 1000.0 / kPollMilliseconds * (60.0 + 5.0 * limits.cpu_seconds)));
  int silent_polls = 0;
  bool complete = false;
  while (!complete) {
    struct pollfd ready {
      child.pipe(), POLLIN, 0
    };
    const int polled = ::poll(&ready, 1, kPollMilliseconds);
    if (while_waiting) while_waiting();
    if (polled <= 0) {
      // another child may hold the pipe open after this one's end
      if (polled == 0 && child.wait(WNOHANG) && ::poll(&ready, 1, 0) == 0) break;
      if (polled == 0 && ++silent_polls > most_polls) {
        result.failure = "it was ended: it waits for something";
        return result;
      }
      continue;
    }
    silent_polls = 0;
    const ssize_t size = ::read(child.pipe(), buffer.data(), buffer.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) break;
    complete = reader.add(std::span(buffer).first(static_cast<std::size_t>(size)), result);
  }
  if (reader.done() || !result.failure.empty()) return result;
  child.wait(0);
  if (while_waiting) while_waiting();  // the signal that ended it may have been meant for both
  result.failure = reason_of(child.status(), limits);
  return result;
}

}  // namespace

void restore_default_signals() {
  for (const int signal : {SIGINT,
                           SIGTERM,
                           SIGHUP,
                           SIGSEGV,
                           SIGBUS,
                           SIGFPE,
                           SIGILL,
                           SIGABRT,
                           SIGXCPU,
                           SIGXFSZ,
                           SIGPIPE,
                           SIGTRAP,
                           SIGCHLD}) {
    std::signal(signal, SIG_DFL);
  }
  sigset_t none;
  ::sigemptyset(&none);
  ::pthread_sigmask(SIG_SETMASK, &none, nullptr);
}

void ChildOutput::write(std::span<const std::byte> bytes) {
  if (!bytes.empty()) write_record(pipe_, Record::kBytes, bytes);
}

ChildResult run_in_child(const std::function<void(ChildOutput&)>& work,
                         const ChildLimits& limits,
                         const std::function<void()>& while_waiting) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) fail_to_start("pipe to a child process", errno);
  const pid_t parent = ::getpid();
  const pid_t id = ::fork();
  if (id < 0) {
    const int error = errno;
    ::close(ends[0]);
    ::close(ends[1]);
    fail_to_start("child process", error);
  }
  if (id == 0) run_child(work, limits, parent, ends[1]);
  ::close(ends[1]);
  Child child(id, ends[0]);
  ChildResult result = listen(child, limits, while_waiting);
  if (!result.failure.empty()) result.bytes.clear();
  return result;
}

}  // namespace pointflight
