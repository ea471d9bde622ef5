#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/support.hpp"

// Whole flights: the same bytes everywhere, and real maps where they are present.
namespace pointflight {
namespace {

using testing::read_file;
using testing::shared_data;
using testing::TemporaryFolder;

int run(const std::string& arguments, const std::string& before = "") {
  const std::string command =
      fmt::format("{} '{}' {} >/dev/null 2>&1", before, POINTFLIGHT_PROGRAM, arguments);
  return std::system(command.c_str());  // NOLINT(concurrency-mt-unsafe)
}

/// All bytes of a run but those that hold wall-clock figures.
std::string bytes_of(const std::string& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && entry.path().filename() != "timing.json") {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  std::string all;
  for (const auto& file : files) all += file.filename().string() + read_file(file.string());
  return all;
}

TEST(Flight, TheSameBytesWhateverTheThreadsAndTheProcessor) {
  const TemporaryFolder folder;
  const std::string map = folder / "m.pfmap";
  ASSERT_EQ(
      run(fmt::format("map forest --size-x 24 --size-y 20 --density 300 -o {}", folder / "m.pcd")),
      0);
  ASSERT_EQ(run(fmt::format("map import {} -o {} --resolution 0.1", folder / "m.pcd", map)), 0);
  ASSERT_EQ(run(fmt::format("scenario new {} -o {} --length 6", map, folder / "s.yaml")), 0);
  const auto fly = [&](const std::string& name, int threads, const std::string& environment) {
    EXPECT_EQ(
        run(fmt::format(
                "fly {} -o {} --threads {} --seed 7", folder / "s.yaml", folder / name, threads),
            environment),
        0);
    return bytes_of(folder / name);
  };
  const std::string reference = fly("one", 1, "");
  EXPECT_GT(reference.size(), 1000000u);
  EXPECT_TRUE(reference == fly("two", 2, ""));
  EXPECT_TRUE(reference == fly("eight", 8, ""));
  // glibc picks other code for sin, exp, ... without FMA and AVX2
  EXPECT_TRUE(reference ==
              fly("masked",
                  2,
                  "GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-AVX2,-FMA4,-AVX2_Usable,-FMA_Usable"));
  // and the map itself
  EXPECT_EQ(run(fmt::format("map import {} -o {} --resolution 0.1 --threads 1",
                            folder / "m.pcd",
                            folder / "n.pfmap"),
                "GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-AVX2,-FMA4,-AVX2_Usable,-FMA_Usable"),
            0);
  EXPECT_TRUE(read_file(map) == read_file(folder / "n.pfmap"));
}

struct RealMap {
  const char* name;
  const char* flags;
};

class RealFlight : public ::testing::TestWithParam<RealMap> {};

TEST_P(RealFlight, ImportsScansAndFliesFortyMetresWithoutACollision) {
  const std::string cloud = shared_data(fmt::format("maps/{}.pcd", GetParam().name));
  SKIP_WITHOUT(cloud);
  const TemporaryFolder folder;
  const std::string map = folder / "m.pfmap";
  ASSERT_EQ(run(fmt::format("map import {} -o {} {}", cloud, map, GetParam().flags)), 0);
  ASSERT_EQ(run(fmt::format("map info {} --verify", map)), 0);
  ASSERT_EQ(run(fmt::format("scenario new {} -o {} --length 42", map, folder / "s.yaml")), 0);
  ASSERT_EQ(run(fmt::format("fly {} -o {}", folder / "s.yaml", folder / "run")), 0);
  const auto summary = nlohmann::json::parse(read_file(folder / "run/summary.json"));
  const auto timing = nlohmann::json::parse(read_file(folder / "run/timing.json"));
  EXPECT_GE(summary["distance_flown"].get<double>(), 40.0);
  EXPECT_EQ(summary["collisions"], 0);
  EXPECT_GT(summary["closest_approach"].get<double>(), 0.1);
  const double factor = timing["real_time_factor"].get<double>();
  std::printf("%s: %.1f m, closest %.2f m, real-time factor %.1f (this build)\n",
              GetParam().name,
              summary["distance_flown"].get<double>(),
              summary["closest_approach"].get<double>(),
              factor);
}

INSTANTIATE_TEST_SUITE_P(Maps,
                         RealFlight,
                         ::testing::Values(RealMap{"drone_hall", "--resolution 0.05"},
                                           RealMap{"garage", ""},
                                           RealMap{"forest_tls", ""},
                                           RealMap{"catec_testbed", ""}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace pointflight
