#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <memory>
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

/// The program in a process of its own; killed if nobody ends it.
class Started {
 public:
  explicit Started(const std::string& arguments);
  ~Started();
  Started(const Started&) = delete;
  Started& operator=(const Started&) = delete;

  /// Waits until a file is there; false if the program has ended without.
  [[nodiscard]] bool waits_for(const std::string& path) const;
  /// Sends a signal (0: none) and waits for the end; the exit code.
  int end(int signal) const;
  [[nodiscard]] std::string err() const { return read_file(folder_ / "err"); }

 private:
  TemporaryFolder folder_;
  int process_ = -1;
};

/// One line on stderr that starts with the program's name, exit code 2.
void expect_user_error(const Result& result, const std::string& words);

/// A small forest, imported once a process for all tests that ask for it.
class Program : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (folder_ != nullptr) return;  // for another suite
    folder_ = std::make_unique<TemporaryFolder>();
    ASSERT_EQ(
        run(fmt::format("map forest --size-x 24 --size-y 20 --density 300 -o {}", cloud())).code,
        0);
    ASSERT_EQ(run(fmt::format("map import {} -o {} --resolution 0.1", cloud(), map())).code, 0);
  }
  static std::string cloud() { return *folder_ / "forest.pcd"; }
  static std::string map() { return *folder_ / "forest.pfmap"; }
  inline static std::unique_ptr<TemporaryFolder> folder_;
};

}  // namespace pointflight::testing
