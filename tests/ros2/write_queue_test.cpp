// Bursts leave as far apart as their messages are in the run.
#include "pointflight/ros/ros2/write_queue.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace pointflight {
namespace {

using std::chrono::milliseconds;

constexpr std::int64_t kMs = 1'000'000;  // ns

/// What was written, and when.
struct Written {
  std::mutex mutex;
  std::vector<std::size_t> outputs;
  std::vector<WriteQueue::Clock::time_point> times;

  WriteQueue::Write writer() {
    return [this](std::size_t output, const Bytes&) {
      const std::lock_guard lock(mutex);
      outputs.push_back(output);
      times.push_back(WriteQueue::Clock::now());
    };
  }
  [[nodiscard]] std::size_t count() {
    const std::lock_guard lock(mutex);
    return outputs.size();
  }
};

const Bytes kNothing = std::make_shared<const std::vector<std::byte>>();

void push_burst(WriteQueue& queue, std::int64_t apart) {
  for (std::int64_t i = 0; i < 8; ++i) {
    queue.push(static_cast<std::size_t>(i), kNothing, false, 100, 1'000'000'000 + i * apart);
  }
  queue.wake();
}

void wait_for(Written& written, std::size_t count) {
  while (written.count() < count) std::this_thread::sleep_for(milliseconds(1));
}

TEST(WriteQueue, ABurstLeavesAsItWouldHaveWithoutAWait) {
  Written written;
  WriteQueue queue;
  queue.start(written.writer(), 0.0, 2.0);  // twice as fast as a clock
  const auto start = WriteQueue::Clock::now();
  push_burst(queue, 20 * kMs);
  wait_for(written, 8);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(written.outputs[i], i);
    // 20 ms of the run are 10 ms here, 8 while others wait; a busy machine may take longer
    EXPECT_GE(written.times[i] - start, milliseconds(8 * static_cast<int>(i) - 1)) << i;
  }
}

TEST(WriteQueue, AtOnceIfNobodyAskedForAClockOrItEnds) {
  Written at_once;
  WriteQueue free;
  free.start(at_once.writer(), 0.0, 0.0);
  push_burst(free, 3'600'000 * kMs);
  wait_for(at_once, 8);  // in an hour each, else
  Written ended;
  WriteQueue queue;
  queue.start(ended.writer(), 0.0, 0.001);
  push_burst(queue, 300 * kMs);  // every five minutes
  queue.close();
  EXPECT_EQ(ended.count(), 8u) << "all that waits is written";
  Written jumped;
  WriteQueue other;
  other.start(jumped.writer(), 0.0, 1.0);
  push_burst(other, 3'600'000 * kMs);  // a run that skips time does not stand still
  wait_for(jumped, 8);
}

}  // namespace
}  // namespace pointflight
