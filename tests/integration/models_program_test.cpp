#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/resources.hpp"
#include "tests/integration/program.hpp"

/// Sensors, vehicles and pictures on the command line.
namespace pointflight {
namespace {

using testing::expect_contains;
using testing::expect_user_error;
using testing::Program;
using testing::read_file;
using testing::Result;
using testing::run;
using testing::TemporaryFolder;
using testing::write_file;

TEST(Models, ACopiedSensorFileWorksFromAnywhere) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(data_folder() + "/lidars/vlp32c.yaml", folder / "my16.yaml");
  const std::string there = fmt::format("cd {} &&", folder.path());
  const Result mine = run("lidar show ./my16.yaml", there);
  ASSERT_EQ(mine.code, 0) << mine.err;
  const Result shipped = run("lidar show vlp32c");
  // all but the line with the path
  EXPECT_EQ(mine.out.substr(mine.out.find('\n')), shipped.out.substr(shipped.out.find('\n')));
  expect_contains(mine.out, "# scan: 57878 beams, 32 rings");
  expect_contains(mine.out, "# cost: ");
}

TEST(Models, ASensorInFiveLines) {
  const TemporaryFolder folder;
  write_file(
      folder / "my16.yaml",
      "range_max: 100\npattern: rings\nrings:\n  channels: 16\n  channel_interval_us: 2.304\n");
  const Result show =
      run(fmt::format("lidar show {} --json --png {}", folder / "my16.yaml", folder / "m.png"));
  ASSERT_EQ(show.code, 0) << show.err;
  EXPECT_EQ(read_file(folder / "m.png").substr(1, 3), "PNG");
  const auto json = nlohmann::json::parse(show.out);
  EXPECT_EQ(json["scan"]["rings"], 16);
  EXPECT_NEAR(json["scan"]["elevation_deg"][0].get<double>(), -15.0, 1e-3);
  EXPECT_EQ(json["cost"]["class"], "light");
  EXPECT_EQ(json["cost"]["cores"][1], json["cost"]["cores_as_lines"]) << "its beams are lines";
  EXPECT_NEAR(json["scan"]["spacing_between_rings_deg"][1].get<double>(), 2.0, 1e-3);
  EXPECT_EQ(json["settings"]["rings"]["channels"], 16);
  EXPECT_EQ(json["settings"]["rings"].count("columns"), 0u);  // of another convention
  expect_user_error(
      run(fmt::format("lidar show {} --png {}", folder / "my16.yaml", folder / "m.png")),
      "--force");
  // what is shown can be read
  const Result text = run(fmt::format("lidar show {}", folder / "my16.yaml"));
  write_file(folder / "again.yaml", text.out);
  EXPECT_EQ(run(fmt::format("lidar show {}", folder / "again.yaml")).code, 0);
  expect_user_error(
      run(fmt::format("lidar show {} --png {}", folder / "my16.yaml", folder / "my16.yaml")),
      "give another name");
}

TEST(Models, ListsAreJsonToo) {
  const auto lidars = nlohmann::json::parse(run("lidar list --json").out);
  const auto is_avia = [](const auto& entry) { return entry["name"] == "avia"; };
  EXPECT_TRUE(std::any_of(lidars.begin(), lidars.end(), is_avia));
  const auto vehicles = nlohmann::json::parse(run("vehicle list --json").out);
  EXPECT_EQ(vehicles.size(), model_names("vehicles").size());
  const auto quad = nlohmann::json::parse(run("vehicle show quad_330 --json").out);
  EXPECT_GT(quad["hover"]["thrust_to_weight"].get<double>(), 3.0);
  EXPECT_EQ(quad["settings"]["rotors"].size(), 4u);
  EXPECT_GT(quad["responses"].size(), 5u);
}

TEST(Models, NumbersAreWrittenAsPeopleWrite) {
  for (const char* name : {"avia", "vlp32c", "os1_32", "d455"}) {
    const std::string head = run(fmt::format("lidar show {}", name)).out;
    for (const char* odd : {"-0.00 ", "0000000", "9999999"}) {
      EXPECT_EQ(head.find(odd), std::string::npos) << name << ": " << odd << "\n" << head;
    }
  }
}

TEST(Models, WithoutItsDataTheProgramSaysWhereItLooked) {
  for (const char* command : {"lidar list", "vehicle list", "lidar show avia"}) {
    const Result result = run(command, "POINTFLIGHT_DATA=/no/such/folder");
    expect_user_error(result, "/no/such/folder/");
    expect_contains(result.err, "set POINTFLIGHT_DATA");
    EXPECT_EQ(result.out, "");
  }
}

TEST_F(Program, OwnSensorAndVehicleInAScenarioOfAnotherFolder) {
  const TemporaryFolder folder;
  for (const char* name : {"models", "plans"}) std::filesystem::create_directory(folder / name);
  std::string vehicle = read_file(data_folder() + "/vehicles/quad_330.yaml");
  vehicle.replace(vehicle.find("mass: 1.6"), 9, "mass: 1.9");
  write_file(folder / "models/mine.yaml", vehicle);
  std::filesystem::copy_file(data_folder() + "/lidars/vlp32c.yaml", folder / "models/my32.yaml");
  const Result show = run("vehicle show ./mine.yaml", fmt::format("cd {} &&", folder / "models"));
  ASSERT_EQ(show.code, 0) << show.err;
  expect_contains(show.out, "mass: 1.9");
  write_file(folder / "plans/s.yaml",
             fmt::format("map: {}\nduration: 0.3\nvehicle: {{model: ../models/mine.yaml, start: "
                         "[12, 10, 4]}}\nlidars: [{{model: ../models/my32.yaml, blocked: "
                         "../models/legs.csv}}]\n",
                         map()));
  const std::string fly = fmt::format("fly {} -o {}", folder / "plans/s.yaml", folder / "run");
  expect_user_error(run(fly), "legs.csv");
  write_file(
      folder / "models/legs.csv",
      "azimuth_from_deg,azimuth_to_deg,elevation_from_deg,elevation_to_deg\n-180,180,-90,0\n");
  const Result flown = run(fly);
  EXPECT_EQ(flown.code, 0) << flown.err;
  EXPECT_TRUE(std::filesystem::exists(folder / "run/inputs/legs.csv"));
  const Result again = run(fmt::format("fly {} -o {}", folder / "run/scenario.yaml", folder / "b"));
  EXPECT_EQ(again.code, 0) << again.err;
  const auto first_scan = [&](const char* run) {
    return read_file(folder / run + "/scans/0_000001.pcd");
  };
  EXPECT_EQ(first_scan("run"), first_scan("b"));
}

TEST_F(Program, WhatIsInASensorsWayIsFoundFromScansWithPoses) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "scans");
  std::string poses;
  for (int i = 0; i < 8; ++i) {
    const Result scan = run(fmt::format(
        "scan {} --lidar os0_32 --seed {} --pose {},10,1.5,0,0,{} -o {}/scans/{:02}.pcd",
        map(),
        i,
        10 + i,
        20 * i,
        folder.path(),
        i));
    ASSERT_EQ(scan.code, 0) << scan.err;
    const double half = 0.5 * 20.0 * i * kDegree;
    poses += fmt::format("{} {} 10 1.5 0 0 {} {}\n", i, 10 + i, std::sin(half), std::cos(half));
  }
  write_file(folder / "poses.tum", poses);
  const std::string fit = fmt::format("lidar fit {} --map {}", folder / "scans", map());
  expect_user_error(run(fit + " --poses " + (folder / "poses.tum")), "--like");
  expect_user_error(run(fit + " --like os0_32"), "--poses");
  const Result found = run(fmt::format("{} --poses {} --like os0_32 -o {} --png {}",
                                       fit,
                                       folder / "poses.tum",
                                       folder / "carried.yaml",
                                       folder / "blocked.png"));
  ASSERT_EQ(found.code, 0) << found.err;
  expect_contains(found.out, "in the way");
  expect_contains(found.out, "left by deskewing, from a scan's first beam to its last:");
  expect_contains(read_file(folder / "carried.yaml"), "carried_blocked.csv");
  EXPECT_EQ(read_file(folder / "blocked.png").substr(1, 3), "PNG");
  EXPECT_EQ(run("lidar show " + (folder / "carried.yaml")).code, 0);
  expect_user_error(
      run(fmt::format(
          "{} --poses {} --like os0_32 -o {}", fit, folder / "poses.tum", folder / "carried.yaml")),
      "--force");
}

TEST_F(Program, PicturesOfRunsWithAndWithoutTheirFolder) {
  const TemporaryFolder folder;
  write_file(
      folder / "s.yaml",
      fmt::format("map: {}\nduration: 1\nvehicles:\n  - {{name: scout, copies: 3, start: [12, 10, "
                  "4], copy_offset: [0, 0, 1.5], mission: {{waypoints: [[12, 10, "
                  "4.5]]}}}}\nobstacles: [{{count: 5}}]\n",
                  map()));
  const Result fly = run(fmt::format("fly {} -o {}", folder / "s.yaml", folder / "run"));
  ASSERT_LE(fly.code, 1) << fly.err;  // what meets an obstacle is drawn as well
  EXPECT_EQ(read_file(folder / "run/overview.png").substr(1, 3), "PNG");
  const Result again =
      run(fmt::format("picture {} --map {} -o {}", folder / "run", map(), folder / "again.png"));
  EXPECT_EQ(again.code, 0) << again.err;
  // names, waypoints and all: as wide as that of the flight
  EXPECT_EQ(read_file(folder / "again.png").substr(0, 20),
            read_file(folder / "run/overview.png").substr(0, 20));
}

}  // namespace
}  // namespace pointflight
