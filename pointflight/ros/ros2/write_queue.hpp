#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "pointflight/ros/common/wire.hpp"
#include "pointflight/ros/ros2/raw_type.hpp"

namespace pointflight {

/// Messages on their way to the network, and the thread that writes them.
class WriteQueue {
 public:
  static constexpr std::size_t kQueueMax = 2000;  ///< Messages that wait to be written.
  using Write = std::function<void(std::size_t output, const Bytes& bytes)>;

  ~WriteQueue() { close(); }

  /// `pace`: bytes per second at which messages leave; 0: at once.
  void start(Write write, double pace) {
    worker_ = std::thread([this, write = std::move(write), pace] {
      std::optional<Pacing> pacing;
      if (pace > 0.0) pacing.emplace(pace);
      work(write);
    });
  }

  /// At most `own_max` of one output and kQueueMax in all wait. Returns how many older messages
  /// had to go.
  std::uint64_t push(std::size_t output, const Bytes& bytes, bool latched, std::size_t own_max) {
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
    queue_.push_back({output, bytes, latched});
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
    }
    if (worker_.joinable()) worker_.join();
  }

 private:
  struct Entry {
    std::size_t output = 0;
    Bytes bytes;
    bool latched = false;
  };

  void work(const Write& write) {
    std::unique_lock lock(mutex_);
    for (;;) {
      ready_.wait(lock, [&] { return stop_ || !queue_.empty(); });
      if (queue_.empty()) return;
      const Entry entry = std::move(queue_.front());
      queue_.pop_front();
      lock.unlock();
      write(entry.output, entry.bytes);
      lock.lock();
    }
  }

  std::thread worker_;
  std::mutex mutex_;
  std::condition_variable ready_;
  std::deque<Entry> queue_;
  bool stop_ = false;
};

}  // namespace pointflight
