#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace pointflight {

/// Runs loops on a fixed number of threads (oneTBB inside; std::jthread under the thread
/// sanitizer).
///
/// Chunk boundaries depend on the data only and each chunk writes to its own places, so results
/// never depend on the number of threads.
class Executor {
 public:
  /// `threads` = 0 uses every core this process may run on.
  explicit Executor(int threads = 0);
  ~Executor();
  /// The other one has no threads then and may only be destroyed or assigned to.
  Executor(Executor&&) noexcept;
  /// The same.
  Executor& operator=(Executor&&) noexcept;

  /// How many loops run on, the caller's included; never 0.
  [[nodiscard]] int threads() const { return threads_; }

  /// Calls `body(begin, end)` for the chunks [0, chunk), [chunk, 2 chunk), ... of [0, count), in
  /// any order and in parallel, and returns when all are done. An exception of a chunk is rethrown;
  /// InputError if a mapped file was cut short (core/mapped_file.hpp).
  void parallel_for(std::size_t count,
                    std::size_t chunk,
                    const std::function<void(std::size_t begin, std::size_t end)>& body) const;

  /// The same for callers that hold a lock: threads that wait for others to end their chunks are
  /// not given work of other loops, which might ask for the lock.
  void parallel_for_under_lock(
      std::size_t count,
      std::size_t chunk,
      const std::function<void(std::size_t begin, std::size_t end)>& body) const;

 private:
  struct Arena;
  int threads_;
  std::unique_ptr<Arena> arena_;
};

}  // namespace pointflight
