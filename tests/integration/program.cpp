#include "tests/integration/program.hpp"

#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>

namespace pointflight::testing {

Result run(const std::string& arguments, const std::string& before) {
  const TemporaryFolder folder;
  const std::string command = fmt::format("{} '{}' {} >'{}' 2>'{}'",
                                          before,
                                          POINTFLIGHT_PROGRAM,
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

void expect_user_error(const Result& result, const std::string& words) {
  EXPECT_EQ(result.code, 2) << result.err;
  EXPECT_EQ(result.err.rfind("pointflight: ", 0), 0u) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  expect_contains(result.err, words);
}

}  // namespace pointflight::testing
