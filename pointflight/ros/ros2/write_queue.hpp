#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "pointflight/ros/common/wire.hpp"
#include "pointflight/ros/ros2/raw_type.hpp"

namespace pointflight {

/// Messages on their way to the network, and the thread that writes them.
///
/// A run makes them in bursts: while a scan is rendered none, then all that fell due meanwhile. A
/// reader that keeps five of them (ROS' own profile for sensors) would lose most. So they may leave
/// as far apart as they are in the run, a little less while some wait.
class WriteQueue {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kQueueMax = 2000;  ///< Messages that wait to be written.
  using Write = std::function<void(std::size_t output, const Bytes& bytes)>;

  ~WriteQueue() { close(); }

  /// `pace`: bytes per second at which messages leave; 0: at once. `run_rate`: seconds of the run
  /// per second at which they leave; 0: at once.
  void start(Write write, double pace, double run_rate) {
    run_rate_ = run_rate;
    worker_ = std::thread([this, write = std::move(write), pace] {
      std::optional<Pacing> pacing;
      if (pace > 0.0) pacing.emplace(pace);
      work(write);
    });
  }

  /// At most `own_max` of one output and kQueueMax in all wait. `time`: ns, when it leaves by the
  /// run's clock; nothing: with those before it. Returns how many older messages had to go.
  std::uint64_t push(std::size_t output,
                     const Bytes& bytes,
                     bool latched,
                     std::size_t own_max,
                     std::optional<std::int64_t> time = std::nullopt) {
    const std::lock_guard lock(mutex_);
    const auto is_own = [&](const Entry& e) { return e.output == output; };
    std::uint64_t dropped = 0;
    const auto own = std::count_if(queue_.begin(), queue_.end(), is_own);
    if (static_cast<std::size_t>(own) >= own_max) {
      queue_.erase(std::find_if(queue_.begin(), queue_.end(), is_own));
      ++dropped;
    } else if (queue_.size() >= kQueueMax) {
      // the oldest that is not all that a latecomer would ever get
      const auto oldest =
          std::find_if(queue_.begin(), queue_.end(), [](const Entry& e) { return !e.latched; });
      if (oldest == queue_.end()) return 1;
      queue_.erase(oldest);
      ++dropped;
    }
    queue_.push_back({output, bytes, latched, time, Clock::now()});
    return dropped;
  }

  void wake() {
    const std::lock_guard lock(mutex_);
    if (!queue_.empty()) ready_.notify_one();
  }

  /// Writes what waits, then ends the thread.
  void close() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
      ready_.notify_one();
      stopped_.notify_one();
    }
    if (worker_.joinable()) worker_.join();
  }

 private:
  struct Entry {
    std::size_t output = 0;
    Bytes bytes;
    bool latched = false;
    std::optional<std::int64_t> time;  ///< ns
    Clock::time_point pushed;
  };

  /// When a message may leave that comes after the last one.
  Clock::time_point due_at(const Entry& entry) {
    constexpr double kCatchUp = 1.25;  // faster than the run while messages wait
    constexpr auto kLongest = std::chrono::milliseconds(400);
    const Clock::time_point now = Clock::now();
    if (run_rate_ <= 0.0 || !entry.time) return now;
    const std::int64_t since = *entry.time - std::exchange(last_time_, *entry.time);
    // a start, a reset, a jump; or the run goes faster than was said
    const bool is_next = since >= 0 && since < std::chrono::nanoseconds(kLongest).count();
    if (!is_next || now - entry.pushed > kLongest) return last_due_ = now;
    const std::chrono::duration<double, std::nano> apart(static_cast<double>(since) /
                                                         (kCatchUp * run_rate_));
    last_due_ = std::max(now, last_due_ + std::chrono::duration_cast<Clock::duration>(apart));
    return last_due_;
  }

  void work(const Write& write) {
    std::unique_lock lock(mutex_);
    for (;;) {
      ready_.wait(lock, [&] { return stop_ || !queue_.empty(); });
      if (queue_.empty()) return;
      const Entry entry = std::move(queue_.front());
      queue_.pop_front();
      const Clock::time_point due = due_at(entry);
      if (due - Clock::now() > kSoon) stopped_.wait_until(lock, due, [&] { return stop_; });
      lock.unlock();
      write(entry.output, entry.bytes);
      lock.lock();
    }
  }

  std::thread worker_;
  std::mutex mutex_;
  static constexpr auto kSoon = std::chrono::microseconds(300);  // not worth a sleep

  std::condition_variable ready_, stopped_;
  std::deque<Entry> queue_;
  double run_rate_ = 0.0;
  std::int64_t last_time_ = 0;  ///< ns, of the message before.
  Clock::time_point last_due_;  ///< When it left.
  bool stop_ = false;
};

}  // namespace pointflight
