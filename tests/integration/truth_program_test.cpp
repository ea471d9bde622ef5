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

TEST_F(Program, Slow_MeasuresFidelityInExactScenes) {
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
  expect_user_error(run("fidelity nowhere"), "known: hall, forest, yard, box");
  expect_user_error(run("fidelity box --resolution 0"), "--resolution");
  expect_user_error(run("fidelity box --lidar nosuch"), "nosuch");
}

/// A room with a pillar, 8 x 6 x 3 m, as a file of shapes.
std::string room_csv() {
  std::string csv = "shape,tag,x0,y0,z0,x1,y1,z1,x2,y2,z2,r0,r1\n";
  const auto wall =
      [&](const std::string& a, const std::string& b, const std::string& c, const std::string& d) {
        csv += "triangle,wall," + a + "," + b + "," + c + "\ntriangle,wall," + a + "," + c + "," +
               d + "\n";
      };
  wall("0,0,0", "8,0,0", "8,6,0", "0,6,0");
  wall("0,0,3", "8,0,3", "8,6,3", "0,6,3");
  wall("0,0,0", "8,0,0", "8,0,3", "0,0,3");
  wall("0,6,0", "8,6,0", "8,6,3", "0,6,3");
  wall("0,0,0", "0,6,0", "0,6,3", "0,0,3");
  wall("8,0,0", "8,6,0", "8,6,3", "8,0,3");
  return csv + "cone,pillar,4,3,0,4,3,3,,,,0.1,0.1\n";
}

TEST_F(Program, Slow_SurveysASceneAndFitsItsMapToTheRays) {
  const TemporaryFolder folder;
  write_file(folder / "room.csv", room_csv());
  const Result result = run(
      fmt::format("fidelity {0}/room.csv --survey --seconds 1.5 --fit --poses 2 --resolution 0.1 "
                  "--renderer beam,paper --survey-out {0}/survey --json",
                  folder.path()));
  ASSERT_EQ(result.code, 0) << result.err;
  const auto cases = nlohmann::json::parse(result.out)["cases"];
  ASSERT_EQ(cases.size(), 4u);
  EXPECT_EQ(cases[0]["fitted"], false);
  EXPECT_EQ(cases[2]["fitted"], true);
  EXPECT_EQ(cases[2]["survey"]["lidar"], "mid360");
  EXPECT_GT(cases[2]["inside"]["rays"].get<int>(), 20000);
  EXPECT_LT(cases[2]["inside"]["wrong_fraction"].get<double>(), 0.02);
  EXPECT_LT(cases[2]["edge"]["early_fraction"].get<double>(),
            cases[0]["edge"]["early_fraction"].get<double>());
}

/// The survey of the room in `folder`; the flags that read it.
std::string survey_the_room(const TemporaryFolder& folder) {
  write_file(folder / "room.csv", room_csv());
  const Result made =
      run(fmt::format("fidelity {0}/room.csv --survey --seconds 1 --poses 1 --resolution 0.2 "
                      "--survey-out {0}/survey",
                      folder.path()));
  EXPECT_EQ(made.code, 0) << made.err;
  return fmt::format("--scans {0}/scans --poses {0}/poses.tum --free {0}/free",
                     folder / "survey/room");
}

TEST_F(Program, Slow_FitsAMapToTheScansItWasMadeOf) {
  const TemporaryFolder folder;
  const std::string scans = survey_the_room(folder);
  const std::string survey = folder / "survey/room";
  const Result bare = run(
      fmt::format("map import {}/cloud.pcd --resolution 0.1 -o {}", survey, folder / "bare.pfmap"));
  ASSERT_EQ(bare.code, 0) << bare.err;
  const Result fit = run(fmt::format("map fit {} {} -o {} --export-ghosts {}",
                                     folder / "bare.pfmap",
                                     scans,
                                     folder / "fit.pfmap",
                                     folder / "ghosts.pcd"));
  ASSERT_EQ(fit.code, 0) << fit.err;
  EXPECT_NE(fit.err.find("% right"), std::string::npos) << fit.err;
  EXPECT_TRUE(std::filesystem::exists(folder / "ghosts.pcd"));
  expect_user_error(
      run(fmt::format(
          "map fit {} {} --format pcd -o {}", folder / "bare.pfmap", scans, folder / "x.pfmap")),
      "--format is for clouds");
  const Result info = run(fmt::format("map info {} --json --verify", folder / "fit.pfmap"));
  ASSERT_EQ(info.code, 0) << info.err;
  EXPECT_NE(info.out.find("rays of 10 scans"), std::string::npos) << info.out;
}

TEST_F(Program, Slow_MakesAMapOfScans) {
  const TemporaryFolder folder;
  const std::string scans = survey_the_room(folder);
  const Result whole = run(fmt::format("map import {} -o {}", scans, folder / "auto.pfmap"));
  ASSERT_EQ(whole.code, 0) << whole.err;
  EXPECT_NE(whole.err.find("right of what left out scans saw"), std::string::npos) << whole.err;
  for (const int threads : {1, 3}) {
    ASSERT_EQ(run(fmt::format("map import {} --resolution 0.1 --threads {} -o {}",
                              scans,
                              threads,
                              folder / fmt::format("{}.pfmap", threads)))
                  .code,
              0);
  }
  EXPECT_TRUE(testing::read_file(folder / "1.pfmap") == testing::read_file(folder / "3.pfmap"))
      << "the same bytes for any number of threads";
}

TEST_F(Program, SurveysThatCannotBeAreErrorsOfOneLine) {
  const TemporaryFolder folder;
  write_file(folder / "room.csv", room_csv());
  write_file(folder / "poses.tum", "0 0 0 1 0 0 0 1\n");
  const std::string out = " -o " + (folder / "m.pfmap");
  expect_user_error(run("fidelity hall --survey --beams 7"), "means nothing to --survey");
  expect_user_error(run("fidelity hall --survey --noise 0,0.01"), "one value");
  expect_user_error(run("fidelity hall --seconds 10"), "--survey");
  expect_user_error(
      run(fmt::format("fidelity hall hall --survey --survey-out {}/out", folder.path())),
      "two scenes are named 'hall'");
  expect_user_error(run("fidelity hall --survey --lidar nosuch"), "nosuch");
  expect_user_error(run("map import" + out), "--scans");
  expect_user_error(run("map import --scans " + folder.path() + out), "--poses");
  expect_user_error(
      run(fmt::format(
          "map import --scans {0} --poses {0}/poses.tum --scale 2{1}", folder.path(), out)),
      "map transform");
  std::filesystem::create_directories(folder / "empty");
  expect_user_error(
      run(fmt::format("map import --scans {0}/empty --poses {0}/poses.tum{1}", folder.path(), out)),
      "no clouds");
  EXPECT_FALSE(std::filesystem::exists(folder / "m.pfmap"));
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

TEST_F(Program, ComparesASensorWithRealScans) {
  const TemporaryFolder folder;
  std::string poses;
  for (int i = 0; i < 2; ++i) {
    const std::string name = fmt::format("scan{}.pcd", i);
    ASSERT_EQ(run(fmt::format("scan {} --lidar vlp16 --pose {},10,4,0,0,0 --reflectivity 0.05 "
                              "--seed 9 --index {} -o {}",
                              map(),
                              10 + 2 * i,
                              i,
                              folder / name))
                  .code,
              0);
    // so far apart in time that the way between them says nothing of the motion within a scan
    poses += fmt::format("{} {} 10 4 0 0 0 1 {}\n", 10 * i, 10 + 2 * i, name);
  }
  write_file(folder / "poses.tum", poses);
  const std::string real =
      fmt::format("compare {} --scans {} --poses {}", map(), folder.path(), folder / "poses.tum");
  const Result compared = run(
      fmt::format("{} --lidar vlp16 --reflectivity 0.05 --json --png {}", real, folder / "png"));
  ASSERT_EQ(compared.code, 0) << compared.err;
  const auto sensor = nlohmann::json::parse(compared.out)["sensor"];
  EXPECT_GT(sensor["returns"].get<int>(), 5000);
  EXPECT_LT(sensor["share_distance"]["modelled"].get<double>(), 0.05);
  EXPECT_GT(sensor["shares"].size(), 3u);
  EXPECT_EQ(sensor["edges"].size(), sensor["edge_error_limits"].size() + 1);
  EXPECT_TRUE(std::filesystem::exists(folder / "png/sensor.png"));
  const Result text = run(real + " --lidar vlp16");
  ASSERT_EQ(text.code, 0) << text.err;
  EXPECT_NE(text.out.find("mean difference from the real share"), std::string::npos) << text.out;
  expect_user_error(run(real + " --lidar nosuch"), "nosuch");
  expect_user_error(run(real + " --sun 0"), "--lidar");
}

TEST_F(Program, MapsHaveReflectivities) {
  const TemporaryFolder folder;
  write_file(folder / "grey.xyz", [] {
    std::string rows;
    for (int i = 0; i < 60; ++i) {
      for (int k = 0; k < 60; ++k) rows += fmt::format("5 {} {} 20\n", 0.1 * i - 3, 0.1 * k - 3);
    }
    return rows;
  }());
  const std::string import = fmt::format(
      "map import {} -o {} --resolution 0.2 --force", folder / "grey.xyz", folder / "grey.pfmap");
  ASSERT_EQ(run(import + " --reflectivity 0.01").code, 0);
  const auto info =
      nlohmann::json::parse(run(fmt::format("map info {} --json", folder / "grey.pfmap")).out);
  EXPECT_EQ(info["reflectivity_per_intensity"].get<double>(), 0.01);
  // a Mid-360 gives a diffuse target of 20 % an intensity of 0.2 times that of 100 %
  const auto scanned = run(
      fmt::format("scan {} --pose 0,0,0,0,0,0 -o {}", folder / "grey.pfmap", folder / "scan.pcd"));
  ASSERT_EQ(scanned.code, 0) << scanned.err;
  expect_user_error(
      run(fmt::format("map import {} -o {} --reflectivity 0.01", cloud(), folder / "none.pfmap")),
      "no intensity");
  expect_user_error(run(import + " --signal-of os0_64"), "--scans");
  EXPECT_FALSE(std::filesystem::exists(folder / "none.pfmap"));
}

TEST_F(Program, PaintsAMapBySignals) {
  const TemporaryFolder folder;
  const std::string scans = survey_the_room(folder);
  const Result bare = run(fmt::format(
      "map import {} --resolution 0.1 --signal-of os0_64 -o {}", scans, folder / "painted.pfmap"));
  // its scans have no intensity
  expect_user_error(bare, "--signal-of os0_64: the scans carry no intensities");
  expect_user_error(run(fmt::format("map import {} --signal-of marsim_grid --resolution 0.1 -o {}",
                                    scans,
                                    folder / "painted.pfmap")),
                    "no rated ranges");
  EXPECT_FALSE(std::filesystem::exists(folder / "painted.pfmap"));
}

}  // namespace
}  // namespace pointflight
