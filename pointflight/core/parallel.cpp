#include "pointflight/core/parallel.hpp"

#include <algorithm>
#include <thread>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/cpu_account.hpp"
#include "pointflight/core/mapped_file.hpp"

#ifdef POINTFLIGHT_HAS_TBB
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#else
#include <atomic>
#include <exception>
#include <system_error>
#include <vector>
#endif

namespace pointflight {

#ifdef POINTFLIGHT_HAS_TBB

struct Executor::Arena {
  explicit Arena(int threads)
      : limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads)),
        arena(threads) {}
  tbb::global_control limit;  ///< Without it TBB warns of more threads than cores.
  mutable tbb::task_arena arena;
};

Executor::Executor(int threads)
    : threads_(threads > 0 ? threads : tbb::info::default_concurrency()),
      // one thread needs none, and its limit would hold for every other executor too
      arena_(threads_ > 1 ? std::make_unique<Arena>(threads_) : nullptr) {}

namespace {

/// The chunks of a loop; `in_parallel(chunks, run_chunk)` runs more than one of them on threads.
template <class InParallel>
void run_chunks(std::size_t count,
                std::size_t chunk,
                bool on_one_thread,
                const std::function<void(std::size_t, std::size_t)>& body,
                const InParallel& in_parallel) {
  require_argument(chunk > 0, "parallel_for: a chunk has at least one");
  const std::size_t chunks = (count + chunk - 1) / chunk;
  CpuAccount* const account = ChargeTo::current();
  const auto run_chunk = [&](std::size_t i) {
    const ChargeTo charge(account);
    body(i * chunk, std::min(count, (i + 1) * chunk));
  };
  if (on_one_thread || chunks <= 1) {
    for (std::size_t i = 0; i < chunks; ++i) run_chunk(i);
  } else {
    in_parallel(chunks, run_chunk);
  }
  throw_if_mapped_file_was_cut();
}

}  // namespace

void Executor::parallel_for(std::size_t count,
                            std::size_t chunk,
                            const std::function<void(std::size_t, std::size_t)>& body) const {
  run_chunks(count, chunk, threads_ == 1, body, [&](std::size_t chunks, const auto& run_chunk) {
    arena_->arena.execute([&] { tbb::parallel_for(std::size_t{0}, chunks, run_chunk); });
  });
}

void Executor::parallel_for_under_lock(
    std::size_t count,
    std::size_t chunk,
    const std::function<void(std::size_t, std::size_t)>& body) const {
  run_chunks(count, chunk, threads_ == 1, body, [&](std::size_t chunks, const auto& run_chunk) {
    arena_->arena.execute([&] {
      tbb::this_task_arena::isolate([&] { tbb::parallel_for(std::size_t{0}, chunks, run_chunk); });
    });
  });
}

#else

struct Executor::Arena {};

Executor::Executor(int threads)
    : threads_(threads > 0 ? threads
                           : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()))) {}

void Executor::parallel_for(std::size_t count,
                            std::size_t chunk,
                            const std::function<void(std::size_t, std::size_t)>& body) const {
  require_argument(chunk > 0, "parallel_for: a chunk has at least one");
  const std::size_t chunks = (count + chunk - 1) / chunk;
  std::atomic<std::size_t> next{0};
  std::atomic<bool> failed{false};
  std::exception_ptr error;
  CpuAccount* const account = ChargeTo::current();
  const auto work = [&] {
    const ChargeTo charge(account);
    for (std::size_t i = next++; i < chunks; i = next++) {
      try {
        body(i * chunk, std::min(count, (i + 1) * chunk));
      } catch (...) {
        if (!failed.exchange(true)) error = std::current_exception();
      }
    }
  };
  {
    std::vector<std::jthread> workers;
    try {
      for (int i = 1; i < threads_ && static_cast<std::size_t>(i) < chunks; ++i) {
        workers.emplace_back(work);
      }
    } catch (const std::system_error&) {  // NOLINT(bugprone-empty-catch): fewer do it as well
    }
    work();
  }
  if (error) std::rethrow_exception(error);
  throw_if_mapped_file_was_cut();
}

void Executor::parallel_for_under_lock(
    std::size_t count,
    std::size_t chunk,
    const std::function<void(std::size_t, std::size_t)>& body) const {
  parallel_for(count, chunk, body);  // whose threads are its own
}

#endif

Executor::~Executor() = default;
Executor::Executor(Executor&&) noexcept = default;
Executor& Executor::operator=(Executor&&) noexcept = default;

}  // namespace pointflight
