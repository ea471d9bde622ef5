#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "pointflight/map/surfel_map.hpp"
#include "tests/paths.hpp"
#include "tests/support.hpp"

// Whole flights: the same bytes everywhere, and real maps if they are present.
namespace pointflight {
namespace {

using testing::read_file;
using testing::shared_data;
using testing::TemporaryFolder;

int run_quietly(const std::string& arguments, const std::string& before = "") {
  const std::string command =
      fmt::format("{} '{}' {} >/dev/null 2>&1", before, testing::kProgram, arguments);
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

TEST(Flight, Slow_TheSameBytesWhateverTheThreadsAndTheProcessor) {
  const TemporaryFolder folder;
  const std::string map = folder / "m.pfmap";
  ASSERT_EQ(run_quietly(fmt::format("map forest --size-x 24 --size-y 20 --density 300 -o {}",
                                    folder / "m.pcd")),
            0);
  ASSERT_EQ(run_quietly(fmt::format("map import {} -o {} --resolution 0.1", folder / "m.pcd", map)),
            0);
  ASSERT_EQ(run_quietly(fmt::format("scenario new {} -o {} --length 3", map, folder / "s.yaml")),
            0);
  const auto fly = [&](const std::string& name, int threads, const std::string& environment) {
    EXPECT_EQ(
        run_quietly(
            fmt::format(
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
  EXPECT_EQ(
      run_quietly(fmt::format("map import {} -o {} --resolution 0.1 --threads 1",
                              folder / "m.pcd",
                              folder / "n.pfmap"),
                  "GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-AVX2,-FMA4,-AVX2_Usable,-FMA_Usable"),
      0);
  EXPECT_TRUE(read_file(map) == read_file(folder / "n.pfmap"));
}

/// Runs the program and returns its peak resident memory in MB; negative if it failed.
double peak_memory_of(const std::string& arguments) {
  const std::string command =
      fmt::format("exec '{}' {} >/dev/null 2>&1", testing::kProgram, arguments);
  const pid_t child = fork();
  if (child == 0) {
    execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    _exit(127);
  }
  int status = 0;
  rusage usage{};
  wait4(child, &status, 0, &usage);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return -1.0;
  return static_cast<double>(usage.ru_maxrss) * 1024.0 * 1e-6;
}

struct RealMap {
  std::string name;
  std::string flags;
  double length;  ///< Of the flight, m.
};

void PrintTo(const RealMap& map, std::ostream* out) {
  *out << map.name;
}

class RealFlight : public ::testing::TestWithParam<RealMap> {};

TEST_P(RealFlight, Slow_ImportsScansAndFliesWithoutACollision) {
  const RealMap& param = GetParam();
  const std::string cloud = shared_data(fmt::format("maps/{}.pcd", param.name));
  SKIP_WITHOUT(cloud);
  const TemporaryFolder folder;
  const std::string map = folder / "m.pfmap";
  ASSERT_EQ(run_quietly(fmt::format("map import {} -o {} {}", cloud, map, param.flags)), 0);
  ASSERT_EQ(run_quietly(fmt::format("map info {} --verify", map)), 0);
  ASSERT_EQ(run_quietly(fmt::format(
                "scenario new {} -o {} --length {}", map, folder / "s.yaml", param.length + 2.0)),
            0);

  const auto start = std::chrono::steady_clock::now();
  const auto opened = SurfelMap::open(map);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;  // is said
  EXPECT_GT(opened->surfel_count(), 0u);

  const double memory =
      peak_memory_of(fmt::format("fly {} -o {}", folder / "s.yaml", folder / "run"));
  ASSERT_GE(memory, 0.0);
  const auto summary = nlohmann::json::parse(read_file(folder / "run/summary.json"))["vehicles"][0];
  const auto timing = nlohmann::json::parse(read_file(folder / "run/timing.json"));
  EXPECT_GE(summary["distance_flown"].get<double>(), param.length);
  EXPECT_EQ(summary["collisions"], 0);
  EXPECT_GT(summary["closest_approach"].get<double>(), 0.1);
  // a sanitizer's shadow would count
  if (!testing::kSanitized) {
    EXPECT_LT(memory, 80.0);
  }
  std::printf(
      "%s: opened in %.2f ms; %.1f m, closest %.2f m, %.0f MB at most, real-time factor "
      "%.1f (this build)\n",
      param.name.c_str(),
      1e3 * took.count(),
      summary["distance_flown"].get<double>(),
      summary["closest_approach"].get<double>(),
      memory,
      timing["real_time_factor"].get<double>());
}

INSTANTIATE_TEST_SUITE_P(Maps,
                         RealFlight,
                         ::testing::Values(RealMap{"drone_hall", "--resolution 0.05", 40.0},
                                           RealMap{"garage", "", 15.0},
                                           RealMap{"forest_tls", "", 15.0},
                                           RealMap{"catec_testbed", "", 15.0}),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace pointflight
