#include "tests/integration/program.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <thread>

#include "tests/paths.hpp"

namespace pointflight::testing {

Result run(const std::string& arguments, const std::string& before) {
  const TemporaryFolder folder;
  const std::string command = fmt::format("{} '{}' {} >'{}' 2>'{}'",
                                          before,
                                          testing::kProgram,
                                          arguments,
                                          folder / "out",
                                          folder / "err");
  const int status = std::system(command.c_str());  // NOLINT(concurrency-mt-unsafe)
  Result result;
  result.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.out = read_file(folder / "out");
  result.err = read_file(folder / "err");
  return result;
}

Started::Started(const std::string& arguments) {
  const std::string command = fmt::format(
      "exec '{}' {} >'{}' 2>'{}'", testing::kProgram, arguments, folder_ / "out", folder_ / "err");
  process_ = ::fork();
  if (process_ == 0) {
    ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    ::_exit(127);
  }
}

Started::~Started() {
  if (::waitpid(process_, nullptr, WNOHANG) == 0) {
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }
}

bool Started::waits_for(const std::string& path) const {
  while (!std::filesystem::exists(path)) {
    siginfo_t info{};
    const int failed =
        ::waitid(P_PID, static_cast<id_t>(process_), &info, WEXITED | WNOHANG | WNOWAIT);
    if (failed != 0 || info.si_pid != 0) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return true;
}

int Started::end(int signal) const {
  if (signal != 0) ::kill(process_, signal);
  siginfo_t info{};
  ::waitid(P_PID, static_cast<id_t>(process_), &info, WEXITED | WNOWAIT);
  return info.si_code == CLD_EXITED ? info.si_status : 128 + info.si_status;
}

void expect_user_error(const Result& result, const std::string& words) {
  EXPECT_EQ(result.code, 2) << result.err;
  // behind what a busy machine has said of its progress
  std::string_view said = result.err;
  while (said.find(" %\n") != said.npos && said.find(" %\n") < said.find("pointflight: ")) {
    said.remove_prefix(said.find('\n') + 1);
  }
  EXPECT_EQ(said.rfind("pointflight: ", 0), 0u) << result.err;
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << result.err;
  expect_contains(result.err, words);
}

}  // namespace pointflight::testing
