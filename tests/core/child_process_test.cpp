#include "pointflight/core/child_process.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <new>
#include <stdexcept>
#include <thread>

#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::expect_contains;

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

TEST(ChildProcess, WhatItWritesComesBackInOrder) {
  std::string large(3'000'000, 'x');  // many times what a pipe holds
  for (std::size_t i = 0; i < large.size(); ++i) large[i] = static_cast<char>('a' + i % 23);
  int changed = 0;
  const ChildResult result = run_in_child(
      [&](ChildOutput& output) {
        changed = 1;  // the copy's own
        output.write(bytes_of("first "));
        output.write({});
        output.write(bytes_of(large));
      },
      {});
  EXPECT_EQ(result.failure, "");
  ASSERT_EQ(result.bytes.size(), 6 + large.size());
  EXPECT_EQ(std::memcmp(result.bytes.data(), "first ", 6), 0);
  EXPECT_EQ(std::memcmp(result.bytes.data() + 6, large.data(), large.size()), 0);
  EXPECT_EQ(changed, 0);
}

TEST(ChildProcess, ItsDeathIsAReasonAndNotTheProgramsEnd) {
  const auto failure_of = [](const std::function<void(ChildOutput&)>& work) {
    const ChildResult result = run_in_child(work, {});
    EXPECT_TRUE(result.bytes.empty());
    return result.failure;
  };
  EXPECT_EQ(failure_of([](ChildOutput& output) {
              output.write(bytes_of("half"));
              std::abort();
            }),
            "it crashed (SIGABRT)");
  EXPECT_EQ(failure_of([](ChildOutput&) { std::raise(SIGFPE); }), "it crashed (SIGFPE)");
  EXPECT_EQ(failure_of([](ChildOutput&) { ::_exit(0); }), "it ended early");
  EXPECT_EQ(failure_of([](ChildOutput&) { throw std::runtime_error("no luck"); }), "no luck");
  EXPECT_EQ(failure_of([](ChildOutput&) { throw std::bad_alloc(); }), "it takes too much memory");
}

TEST(ChildProcess, WhatDoesNotEndIsEnded) {
  const ChildResult result = run_in_child(
      [](ChildOutput&) {
        for (std::atomic<std::uint64_t> count{0};; ++count) {
        }
      },
      {.cpu_seconds = 1.0});
  expect_contains(result.failure, "more than 1 s");
}

TEST(ChildProcess, MemoryHasALimit) {
  if (testing::kSanitized) GTEST_SKIP() << "the shadow of a sanitizer would count";
  const ChildResult result = run_in_child(
      [](ChildOutput& output) {
        std::vector<std::vector<char>> all;
        for (int i = 0; i < 1000; ++i) all.emplace_back(10'000'000, 'x');
        output.write(bytes_of("took it all"));
      },
      {.cpu_seconds = 20.0, .memory_bytes = std::size_t{200} << 20});
  EXPECT_EQ(result.failure, "it takes too much memory");
}

TEST(ChildProcess, WhoWaitsMayGiveUp) {
  struct GaveUp {};
  int asked = 0;
  EXPECT_THROW(run_in_child([](ChildOutput&) { ::pause(); },
                            {},
                            [&] {
                              if (++asked == 3) throw GaveUp();
                            }),
               GaveUp);
}

TEST(ChildProcess, BesideThreadsThatTakeMemory) {
  std::atomic<bool> stop{false};
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      while (!stop) std::vector<char>(100'000, 'x').clear();
    });
  }
  for (int i = 0; i < testing::repeats(50); ++i) {
    const ChildResult result = run_in_child(
        [](ChildOutput& output) { output.write(bytes_of(std::string(1000, 'y'))); }, {});
    EXPECT_EQ(result.failure, "");
    EXPECT_EQ(result.bytes.size(), 1000u);
  }
  stop = true;
  for (std::thread& thread : threads) thread.join();
}

TEST(ChildProcess, WhereTheProgramIgnoresItsChildren) {
  const auto before = std::signal(SIGCHLD, SIG_IGN);
  const ChildResult done =
      run_in_child([](ChildOutput& output) { output.write(bytes_of("done")); }, {});
  const ChildResult dead = run_in_child([](ChildOutput&) { std::abort(); }, {});
  std::signal(SIGCHLD, before);
  EXPECT_EQ(done.failure, "");
  EXPECT_EQ(done.bytes.size(), 4u);
  EXPECT_EQ(dead.failure, "it ended early");
}

}  // namespace
}  // namespace pointflight
