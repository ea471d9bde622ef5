// Programs under limits: how they end, and that nothing of them is left.
#include "pointflight/campaign/process.hpp"

#include <gtest/gtest.h>

#include <csignal>
#include <thread>

#include "pointflight/campaign/engines.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::read_file;
using testing::TemporaryFolder;

ProcessResult shell(const TemporaryFolder& folder,
                    const std::string& script,
                    double time_limit = 0.0,
                    double memory_limit = 0.0) {
  const std::atomic<bool> never = false;
  ProcessRequest request;
  request.command = {"sh", "-c", script};
  request.log = folder / "log";
  request.time_limit = time_limit;
  request.memory_limit = memory_limit;
  return run_process(request, never);
}

TEST(Process, EndsWithItsCodeOrItsSignal) {
  const TemporaryFolder folder;
  EXPECT_EQ(shell(folder, "echo out; echo err >&2; exit 3").exit_code, 3);
  EXPECT_EQ(read_file(folder / "log"), "out\nerr\n");
  const ProcessResult killed = shell(folder, "kill -SEGV $$");
  EXPECT_EQ(killed.signal, SIGSEGV);
  EXPECT_EQ(killed.exit_code, -1);
  EXPECT_EQ(shell(folder, "read x; exit $?").exit_code, 1);  // nothing on its input
}

TEST(Process, StartsWithTheSignalsOfAnyProgram) {
  const TemporaryFolder folder;
  const auto before = std::signal(SIGPIPE, SIG_IGN);  // as our own programs have it
  EXPECT_EQ(shell(folder, "kill -PIPE $$; exit 3").signal, SIGPIPE);
  std::signal(SIGPIPE, before);
  // if somebody ignores the end of children, how they ended is not known; that it is over is
  const auto child = std::signal(SIGCHLD, SIG_IGN);
  const ProcessResult ended = shell(folder, "exit 0");
  std::signal(SIGCHLD, child);
  EXPECT_EQ(ended.exit_code, -1);
  EXPECT_EQ(ended.signal, 0);
}

TEST(Process, ErrorsMayGoElsewhere) {
  const TemporaryFolder folder;
  const std::atomic<bool> never = false;
  ProcessRequest request;
  request.command = {"sh", "-c", "echo out; echo err >&2"};
  request.log = folder / "log";
  request.errors = folder / "errors";
  EXPECT_EQ(run_process(request, never).exit_code, 0);
  EXPECT_EQ(read_file(folder / "log"), "out\n");
  EXPECT_EQ(read_file(folder / "errors"), "err\n");
}

TEST(Process, IsEndedAfterItsTimeWithAllItStarted) {
  const TemporaryFolder folder;
  const ProcessResult late =
      shell(folder, "sleep 300 & echo $! >" + (folder / "pid") + "; wait", 5.0);
  EXPECT_TRUE(late.timed_out);
  EXPECT_GE(late.wall_seconds, 5.0);
  const pid_t left = std::stoi(read_file(folder / "pid"));
  // it may take the system a moment to take it away
  for (int i = 0; i < 10'000 && kill(left, 0) == 0; ++i) {
    const std::string state = read_file("/proc/" + std::to_string(left) + "/stat");
    if (state.find(") Z") != std::string::npos) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  const bool is_gone = kill(left, 0) != 0;
  EXPECT_TRUE(is_gone || read_file("/proc/" + std::to_string(left) + "/stat").find(") Z") !=
                             std::string::npos);
}

TEST(Process, IsEndedWhenItIsToldTo) {
  const TemporaryFolder folder;
  std::atomic<bool> stop = false;
  ProcessRequest request;
  request.command = {"sleep", "300"};
  request.log = folder / "log";
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    stop = true;
  });
  const ProcessResult ended = run_process(request, stop);
  later.join();
  EXPECT_TRUE(ended.interrupted);
  EXPECT_EQ(ended.signal, SIGTERM);
}

TEST(Process, GetsNoMoreMemoryThanItMay) {
  if (testing::kSanitized) GTEST_SKIP() << "the sanitizer's own memory would count";
  const TemporaryFolder folder;
  const std::string take = "x=$(head -c 200000000 /dev/zero | tr '\\0' 'x'); echo ${#x}";
  EXPECT_EQ(shell(folder, take).exit_code, 0);
  const ProcessResult limited = shell(folder, take, 0.0, 1e8);
  EXPECT_NE(limited.exit_code, 0);
}

TEST(Process, ThatIsNotThereIsSaid) {
  const TemporaryFolder folder;
  const std::atomic<bool> never = false;
  ProcessRequest request;
  request.log = folder / "log";
  request.command = {"no-such-program-at-all"};
  expect_contains(error_of([&] { run_process(request, never); }), "there is no such program");
  request.command = {"/etc/passwd"};
  expect_contains(error_of([&] { run_process(request, never); }), "/etc/passwd: ");
  request.command = {"true"};
  request.folder = folder / "nowhere";
  expect_contains(error_of([&] { run_process(request, never); }), "No such file");
}

TEST(Share, IsEachFlightOnce) {
  const std::vector<std::size_t> numbers = {0, 1, 2, 5, 7, 8, 9, 12};
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < 3; ++i) {
    for (const std::size_t n : share_of(numbers, {i, 3})) all.push_back(n);
  }
  std::sort(all.begin(), all.end());
  EXPECT_EQ(all, numbers);
  EXPECT_EQ(parse_share("3/16").index, 3u);
  // what the fourth of eight left is spread over seven
  EXPECT_EQ(even_shares({3, 11, 19, 27, 35, 43, 51}, 8), 7u);
  EXPECT_EQ(even_shares({0, 1, 2, 3, 4, 5, 6, 7}, 8), 8u);
  EXPECT_EQ(even_shares({5}, 1), 1u);
  EXPECT_EQ(even_shares(std::vector<std::size_t>(100'000, 7), 100'000), 100'000u);  // at once
  for (const char* wrong : {"", "3", "3/", "/3", "3/3", "-1/3", "0/0", "1.5/3", "a/b"}) {
    expect_contains(error_of([&] { parse_share(wrong); }), "--share");
  }
}

}  // namespace
}  // namespace pointflight
