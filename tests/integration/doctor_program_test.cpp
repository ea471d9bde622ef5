#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "pointflight/core/resources.hpp"
#include "tests/integration/program.hpp"

/// What a machine has and computes.
namespace pointflight {
namespace {

using testing::expect_contains;
using testing::Result;
using testing::run;
using testing::TemporaryFolder;
using testing::write_file;

TEST(Doctor, SaysWhatThereIs) {
  const Result result = run("doctor");
  EXPECT_EQ(result.code, 0) << result.out;
  for (const char* word :
       {"version", "processor", "memory", "data", "folder", "GPU", "ROS 2", "network"}) {
    expect_contains(result.out, word);
  }
  const auto json = nlohmann::json::parse(run("doctor --json").out);
  EXPECT_GE(json.size(), 12u);
  for (const auto& row : json) {
    EXPECT_FALSE(row["said"].get<std::string>().empty()) << row["what"];
    EXPECT_NE(row["finding"] == "ok", !row["remedy"].get<std::string>().empty()) << row["what"];
  }
}

TEST(Doctor, SaysWhatIsMissing) {
  const TemporaryFolder folder;
  const Result result = run("doctor", fmt::format("POINTFLIGHT_DATA={}", folder.path()));
  EXPECT_EQ(result.code, 1);
  expect_contains(result.out, "TROUBLE  data");
  expect_contains(result.out, "-> install again");
}

TEST(SelfTest, ThisMachineComputesWhatTheReleaseDoes) {
  const Result result = run("self-test");
  EXPECT_EQ(result.code, 0) << result.out;
  expect_contains(result.out, "the same bytes as the release");
}

TEST(SelfTest, OtherBytesAreSeen) {
  const TemporaryFolder folder;
  std::filesystem::copy(data_folder(), folder / "data", std::filesystem::copy_options::recursive);
  write_file(folder / "data/self_test.csv", "map,0123456789abcdef\n");
  const Result result =
      run("self-test --json --threads 1", fmt::format("POINTFLIGHT_DATA={}", folder / "data"));
  EXPECT_EQ(result.code, 1);
  EXPECT_EQ(nlohmann::json::parse(result.out)["same"], false);
}

}  // namespace
}  // namespace pointflight
