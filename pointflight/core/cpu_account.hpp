// What of a program's CPU time goes where.
#pragma once

#include <atomic>
#include <cstdint>

namespace pointflight {

/// CPU time of threads, summed up. Any thread may charge it.
class CpuAccount {
 public:
  /// So far; what is under way is not in it.
  [[nodiscard]] double seconds() const { return 1e-9 * static_cast<double>(nanoseconds_.load()); }
  /// So many more.
  void add(std::int64_t nanoseconds) { nanoseconds_ += nanoseconds; }

 private:
  std::atomic<std::int64_t> nanoseconds_{0};
};

/// As long as it lives, what this thread does is charged to an account, and so are the chunks of
/// loops that it has an `Executor` run on other threads. Within each other: to the innermost.
class ChargeTo {
 public:
  /// Null: to nobody.
  explicit ChargeTo(CpuAccount* account);
  ~ChargeTo();
  ChargeTo(const ChargeTo&) = delete;
  ChargeTo& operator=(const ChargeTo&) = delete;

  /// Of this thread; null: nobody's.
  [[nodiscard]] static CpuAccount* current();

 private:
  CpuAccount* outer_;
};

/// CPU time of all threads of this process, s.
[[nodiscard]] double process_cpu_time();

}  // namespace pointflight
