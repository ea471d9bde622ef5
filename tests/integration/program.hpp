#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/support.hpp"

/// Runs the program as a user would: exit codes, messages, files.
namespace pointflight::testing {

struct Result {
  int code = -1;
  std::string out;
  std::string err;
};

/// Runs `pointflight ARGUMENTS`; `before` stands before the program's name on the command line.
Result run(const std::string& arguments, const std::string& before = "");

/// One line on stderr that starts with the program's name, exit code 2.
void expect_user_error(const Result& result, const std::string& words);

/// A small forest, imported once for all tests that ask for it.
class Program : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    ASSERT_EQ(
        run(fmt::format("map forest --size-x 24 --size-y 20 --density 300 -o {}", cloud())).code,
        0);
    ASSERT_EQ(run(fmt::format("map import {} -o {} --resolution 0.1", cloud(), map())).code, 0);
  }
  static void TearDownTestSuite() { delete folder_; }
  static std::string cloud() { return *folder_ / "forest.pcd"; }
  static std::string map() { return *folder_ / "forest.pfmap"; }
  inline static TemporaryFolder* folder_ = nullptr;
};

}  // namespace pointflight::testing
