#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "tests/integration/program.hpp"

namespace pointflight {
namespace {

using testing::expect_user_error;
using testing::Program;
using testing::Result;
using testing::run;
using testing::TemporaryFolder;
using testing::write_file;

TEST_F(Program, MeasuresFidelityInExactScenes) {
  const TemporaryFolder folder;
  const Result result =
      run(fmt::format("fidelity box partition_5cm --resolution 0.1 --noise 0,0.005 --poses 3 "
                      "--beams 3000 --renderer beam,paper --json --png {}",
                      folder / "pictures"));
  ASSERT_EQ(result.code, 0) << result.err;
  const auto cases = nlohmann::json::parse(result.out)["cases"];
  ASSERT_EQ(cases.size(), 8u);
  for (const auto& row : cases) {
    EXPECT_EQ(row["all"]["rays"], 9000);
    EXPECT_EQ(row["by_kind"].size(), 1u);
    if (row["scene"] != "box" || row["renderer"] != "beam") continue;
    EXPECT_LT(row["all"]["leak_fraction"].get<double>(), 2e-3);
    EXPECT_LT(row["all"]["early_fraction"].get<double>(), 2e-3);
    EXPECT_LT(row["all"]["median_abs_error"].get<double>(), 0.003);
  }
  EXPECT_TRUE(std::filesystem::exists(folder / "pictures/box_0.1_0mm_beam.png"));
  EXPECT_TRUE(std::filesystem::exists(folder / "pictures/partition_5cm_0.1_5mm_paper.png"));
  expect_user_error(run("fidelity nowhere"), "known: hall, forest, box");
  expect_user_error(run("fidelity box --resolution 0"), "--resolution");
  expect_user_error(run("fidelity box --lidar nosuch"), "nosuch");
}

TEST_F(Program, ComparesRealScansWithAMap) {
  // scans that the program itself takes stand for real ones
  const TemporaryFolder folder;
  std::string poses = "# time tx ty tz qx qy qz qw file\n";
  for (int i = 0; i < 2; ++i) {
    const std::string name = fmt::format("scan{}.pcd", i);
    ASSERT_EQ(run(fmt::format("scan {} --lidar marsim_grid --pose {},10,4,0,0,90 --no-noise -o {}",
                              map(),
                              10 + 2 * i,
                              folder / name))
                  .code,
              0);
    poses += fmt::format("{} {} 10 4 0 0 0.70710678 0.70710678 {}\n", i, 10 + 2 * i, name);
  }
  write_file(folder / "poses.tum", poses);
  const Result compared =
      run(fmt::format("compare {} --scans {} --poses {} --cloud {} --floor --png {} --json",
                      map(),
                      folder.path(),
                      folder / "poses.tum",
                      cloud(),
                      folder / "pictures"));
  ASSERT_EQ(compared.code, 0) << compared.err;
  const auto json = nlohmann::json::parse(compared.out);
  ASSERT_EQ(json["scans"].size(), 2u);
  const auto& all = json["overall"]["all"];
  EXPECT_GT(all["rays"].get<int>(), 50000);
  // the same rays but for the rounding of directions to float
  EXPECT_LT(all["median_abs_error"].get<double>(), 1e-4);
  EXPECT_LT(all["missing_fraction"].get<double>(), 0.01);
  EXPECT_LT(all["wrong_fraction"].get<double>(), 0.01);
  EXPECT_GT(json["overall"]["supported"]["rays"].get<int>(), 1000);
  // one scan beside the other: the ground is flat to a centimetre or two
  const auto& floor = json["floor"];
  EXPECT_GT(floor["rays"].get<int>(), 500);
  EXPECT_LT(floor["median_abs_error"].get<double>(), 0.03);
  EXPECT_TRUE(std::filesystem::exists(folder / "pictures/scan0.png"));
  EXPECT_TRUE(std::filesystem::exists(folder / "pictures/scan1.png"));
  // a pose that is wrong is seen
  write_file(folder / "shifted.tum", "0 10 10 4.5 0 0 0.70710678 0.70710678 scan0.pcd\n");
  const auto shifted =
      nlohmann::json::parse(run(fmt::format("compare {} --scans {} --poses {} --json",
                                            map(),
                                            folder.path(),
                                            folder / "shifted.tum"))
                                .out);
  EXPECT_GT(shifted["overall"]["all"]["late_fraction"].get<double>(), 0.2);
  write_file(folder / "bad.tum", "0 1 2 3 0 0 0\n");
  expect_user_error(
      run(fmt::format(
          "compare {} --scans {} --poses {}", map(), folder.path(), folder / "bad.tum")),
      "bad.tum:1: ");
}

}  // namespace
}  // namespace pointflight
