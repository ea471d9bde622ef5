// Flights by `--renderer gpu` are those by `beam`, byte for byte; skipped without a Vulkan driver.
#include <filesystem>

#include "tests/integration/program.hpp"

namespace pointflight::testing {
namespace {

class GpuProgram : public Program {
 protected:
  void SetUp() override {
    if (run("gpu info").code != 0) GTEST_SKIP() << "no Vulkan device, or a build without";
  }
};

/// All files of a run but what names the renderer or the time it took.
std::map<std::string, std::string> files_of(const std::string& folder) {
  std::map<std::string, std::string> files = snapshot(folder);
  files.erase("scenario.yaml");
  files.erase("timing.json");
  return files;
}

TEST_F(GpuProgram, FlightsAreTheSameBytes) {
  const TemporaryFolder folder;
  // two sensors of which one is of lines and one of wide beams, more vehicles than go together
  write_file(
      folder / "swarm.yaml",
      fmt::format(
          "map: {}\nduration: 0.25\nseed: 4\nvehicles:\n"
          "  - {{name: a, copies: 36, start: [2, 2, 13], copy_offset: [0.55, 0.45, 0], lidars: "
          "[{{model: vlp16, sub_rays: 1}}]}}\n"
          "  - {{name: b, start: [12, 10, 4], lidars: [{{model: mid360}}]}}\n"
          "obstacles:\n  - {{count: 20, radius: 0.5, speed: 3}}\n",
          map()));
  const Result beam =
      run(fmt::format("fly {} -o {} --renderer beam", folder / "swarm.yaml", folder / "beam"));
  ASSERT_EQ(beam.code, 0) << beam.err;
  const Result gpu =
      run(fmt::format("fly {} -o {} --renderer gpu", folder / "swarm.yaml", folder / "gpu"));
  ASSERT_EQ(gpu.code, 0) << gpu.err;
  const auto expected = files_of(folder / "beam");
  const auto got = files_of(folder / "gpu");
  EXPECT_GT(expected.size(), 40u);
  ASSERT_EQ(expected.size(), got.size());
  for (const auto& [name, bytes] : expected) {
    ASSERT_TRUE(got.contains(name)) << name;
    EXPECT_TRUE(got.at(name) == bytes) << name;
  }
  EXPECT_NE(read_file(folder / "gpu/scenario.yaml").find("gpu"), std::string::npos);
}

TEST_F(GpuProgram, TwoAtOnce) {
  const TemporaryFolder folder;
  const auto scan = [&](const std::string& name) {
    return fmt::format("scan {} --pose 12,10,3 --renderer gpu -o {}", map(), folder / name);
  };
  const Started one(scan("one.pcd"));
  const Started other(scan("other.pcd"));
  EXPECT_EQ(one.end(0), 0) << one.err();
  EXPECT_EQ(other.end(0), 0) << other.err();
  ASSERT_EQ(run(fmt::format("scan {} --pose 12,10,3 -o {}", map(), folder / "beam.pcd")).code, 0);
  EXPECT_EQ(read_file(folder / "one.pcd"), read_file(folder / "beam.pcd"));
  EXPECT_EQ(read_file(folder / "other.pcd"), read_file(folder / "beam.pcd"));
}

TEST_F(GpuProgram, WithoutADriverItIsASentence) {
  const TemporaryFolder folder;
  const std::string fly =
      fmt::format("scan {} --pose 12,10,3 -o {} --renderer ", map(), folder / "s.pcd");
  const std::string no_driver = "VK_DRIVER_FILES=/nowhere VK_ICD_FILENAMES=/nowhere";
  expect_user_error(run(fly + "gpu", no_driver), "GPU");
  EXPECT_FALSE(std::filesystem::exists(folder / "s.pcd"));
  expect_user_error(run(fly + "gpu --gpu nobody"), "nobody");
  // whereas auto does without
  const Result automatic = run(fly + "auto", no_driver);
  EXPECT_EQ(automatic.code, 0) << automatic.err;
}

}  // namespace
}  // namespace pointflight::testing
