#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "pointflight/core/resources.hpp"
#include "pointflight/sim/scenario.hpp"
#include "tests/integration/program.hpp"

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

TEST_F(Program, Slow_FliesAMapWithoutAScenario) {
  const TemporaryFolder folder;
  const std::string small = folder / "small.pfmap";
  ASSERT_EQ(run(fmt::format("map forest --size-x 8 --size-y 8 --trees 150 --density 300 -o {}",
                            folder / "small.pcd"))
                .code,
            0);
  ASSERT_EQ(
      run(fmt::format("map import {} -o {} --resolution 0.1", folder / "small.pcd", small)).code,
      0);
  const Result fly = run(fmt::format("fly {} -o {}", small, folder / "run"));
  EXPECT_EQ(fly.code, 0) << fly.err;
  EXPECT_FALSE(read_file(folder / "run/summary.json").empty());
}

// these tests are built on the core alone, as a planner of somebody else is
TEST_F(Program, ItsScenariosAreReadByProgramsOfTheCoreAlone) {
  const TemporaryFolder folder;
  const std::string yaml = folder / "s.yaml";
  ASSERT_EQ(run(fmt::format("scenario new {} -o {}", map(), yaml)).code, 0);
  const Scenario scenario = load_scenario(yaml);
  ASSERT_EQ(scenario.sections.size(), 0u);  // nothing of this program reads what it keeps
  const std::string again = scenario_yaml(scenario);
  for (const char* section : {"ros", "share"}) {
    EXPECT_NE(again.find(fmt::format("\n{}:\n", section)), std::string::npos) << section;
    write_file(folder / "again.yaml", again);
    EXPECT_EQ(load_scenario(folder / "again.yaml").sections_as_is.at(section),
              scenario.sections_as_is.at(section));
  }
  // and the program takes what such a program wrote
  const Result check = run(fmt::format("scenario check {}", folder / "again.yaml"));
  EXPECT_EQ(check.code, 0) << check.err;
}

TEST_F(Program, Slow_ScenarioNewCheckAndFly) {
  const TemporaryFolder folder;
  const std::string yaml = folder / "s.yaml";
  ASSERT_EQ(run(fmt::format("scenario new {} -o {} --length 5", map(), yaml)).code, 0);
  expect_contains(read_file(yaml), "# [m/s] greatest speed");
  const Result check = run(fmt::format("scenario check {}", yaml));
  EXPECT_EQ(check.code, 0) << check.err;
  expect_contains(check.out, "ready:");
  const Result fly = run(fmt::format("fly {} -o {}", yaml, folder / "run"));
  ASSERT_EQ(fly.code, 0) << fly.err;
  expect_contains(fly.out, "closest approach");
  for (const char* name : {"trajectory.csv",
                           "trajectory.tum",
                           "imu.csv",
                           "events.csv",
                           "scans.csv",
                           "summary.json",
                           "timing.json",
                           "overview.png",
                           "scans/0_000000.pcd"}) {
    EXPECT_FALSE(read_file(folder / (std::string("run/") + name)).empty()) << name;
  }
  const auto summary = nlohmann::json::parse(read_file(folder / "run/summary.json"));
  EXPECT_EQ(summary["end"], "completed");
  EXPECT_EQ(summary["vehicles"][0]["collisions"], 0);
  // a second run into the same folder needs --force
  expect_user_error(run(fmt::format("fly {} -o {}", yaml, folder / "run")), "--force");
  EXPECT_EQ(run(fmt::format("fly {} -o {} --force", yaml, folder / "run")).code, 0);
}

TEST_F(Program, AScenarioFindsItsFilesFromItsOwnFolder) {
  const TemporaryFolder folder;
  for (const char* name : {"a", "x"}) std::filesystem::create_directory(folder / name);
  std::filesystem::copy_file(map(), folder / "a/m.pfmap");
  std::filesystem::copy_file(data_folder() + "/lidars/marsim_grid.yaml", folder / "a/my.yaml");
  const Result made = run("scenario new m.pfmap --lidar my.yaml --length 3 -o ../x/s.yaml",
                          fmt::format("cd {} &&", folder / "a"));
  ASSERT_EQ(made.code, 0) << made.err;
  const Result check = run(fmt::format("scenario check {}", folder / "x/s.yaml"));
  EXPECT_EQ(check.code, 0) << check.err;
}

TEST_F(Program, SaysBeforeAndAfterWhatAVehicleCannotFly) {
  const TemporaryFolder folder;
  const auto scenario = [&](const char* rest) {
    return fmt::format("map: {}\nlidars: []\nvehicle:\n  start: [12, 10, 12]\n{}", map(), rest);
  };
  write_file(folder / "s.yaml",
             scenario("mission:\n  speed: 15\n  acceleration: 14\n  jerk: 100\n"
                      "  waypoints: [[2, 10, 12]]\n"));
  const Result check = run(fmt::format("scenario check {}", folder / "s.yaml"));
  EXPECT_EQ(check.code, 0) << check.err;
  expect_contains(check.err, "warning: drone0 at 0 s: the trajectory asks for a tilt of");
  const Result fly = run(fmt::format("fly {} -o {}", folder / "s.yaml", folder / "run"));
  expect_contains(fly.err, "warning: drone0 at 0.000 s: the trajectory asks for a tilt of");
  expect_contains(fly.out, "limits reached");
  expect_contains(read_file(folder / "run/events.csv"), ",beyond_limits,drone0,,12,10,12,,,,\n");
  const auto summary = nlohmann::json::parse(read_file(folder / "run/summary.json"));
  EXPECT_EQ(summary["vehicles"][0]["trajectories_beyond_limits"], 1);
  EXPECT_GT(summary["vehicles"][0]["limited_time"]["acceleration"].get<double>(), 0.1);
  // the picture of a run with such events can be drawn again
  EXPECT_EQ(run(fmt::format("picture {} --map {}", folder / "run", map())).code, 0);
  // nothing to do and no duration: it says why it ends
  write_file(folder / "idle.yaml", scenario(""));
  const Result idle = run(fmt::format("fly {} -o {}", folder / "idle.yaml", folder / "idle"));
  EXPECT_EQ(idle.code, 0) << idle.err;
  expect_contains(idle.out, "idle, after 10.0 s: nothing left to do");
}

TEST_F(Program, BadScenariosSayFileAndLine) {
  const TemporaryFolder folder;
  const auto check = [&](const std::string& text) {
    write_file(folder / "s.yaml", text);
    const Result fly = run(fmt::format("fly {} -o {}", folder / "s.yaml", folder / "run"));
    EXPECT_FALSE(std::filesystem::exists(folder / "run"));
    return fly;
  };
  const std::string map_line = fmt::format("map: {}\n", map());
  expect_user_error(check("seed: 1\n"), "map: missing");
  expect_user_error(check("map: absent.pfmap\n"), "s.yaml:1: map: ");
  expect_user_error(check("map: absent.pfmap\n"), "absent.pfmap: cannot open");
  expect_user_error(check(map_line + "sede: 1\n"),
                    "s.yaml:2: sede: unknown key; did you mean 'seed'");
  expect_user_error(check(map_line + "output:\n  trajectory_rate: -5\n"),
                    "s.yaml:3: output.trajectory_rate");
  expect_user_error(check(map_line + "mission:\n  speed: 2 km/h\n"), "plain number in m/s");
  expect_user_error(check(map_line + "vehicle: {model: helicopter}\n"), "quad_330");
  expect_user_error(check(map_line + "lidars:\n  - model: mid3600\n"),
                    "s.yaml:3: lidars[0].model: ");
  expect_user_error(check(map_line + "vehicle:\n  start: [12, 10, 0.3]\n"),
                    "s.yaml:3: vehicle.start");
  expect_user_error(check(map_line + "vehicle: [\n"), "not valid YAML");
}

TEST_F(Program, NamesThatNoRosTakesAreRefusedWithTheirLine) {
  const TemporaryFolder folder;
  const std::string yaml = folder / "s.yaml";
  ASSERT_EQ(run(fmt::format("scenario new {} -o {} --length 5", map(), yaml)).code, 0);
  const std::string text = read_file(yaml);
  const auto from = text.find("start: [");
  const auto start = text.substr(from, text.find(']', from) + 1 - from);
  const auto check = [&](const std::string& vehicle, const std::string& ros, const char* words) {
    write_file(
        yaml,
        fmt::format(
            "map: {}\nvehicles:\n  - {{{}, name: {}}}\nros: {{{}}}\n", map(), start, vehicle, ros));
    const Result result = run(fmt::format("scenario check {}", yaml));
    if (*words == '\0') {
      EXPECT_EQ(result.code, 0) << result.err;
      return;
    }
    expect_user_error(result, words);
    expect_contains(result.err, fmt::format("s.yaml:{}: ", ros.empty() ? 3 : 4));
  };
  check("uav_1", "", "");
  check("uav-1", "", "'uav-1' is part of ROS topics (/uav-1/odom)");
  check("a", "profile: nosuch", "not among the shipped ros_profiles");
  check("a", "outputs: [{kind: odometry, topic: '/x y'}]", "'/x y' is no topic for ROS");
  check("a", "outputs: [{kind: odometry, topic: '/a//b'}]", "has an empty part");
  check("a", "outputs: [{kind: odometry, frame: /my-odom}]", "'/my-odom' is no frame for ROS");
  check("a", "outputs: [{kind: odometry, frame: 'my odom'}]", "'my odom' is no frame for ROS");
  check("a", "outputs: [{kind: cloud, layout: livos}]", "did you mean 'livox'?");
  check("a", "inputs: [{kind: goal, topic: /go-al}]", "'/go-al' is no topic for ROS");
  check("a", "inputs: [{kind: goal, topic: '/{vehicle}/goal'}]", "");
  expect_user_error(run(fmt::format("fly {} --record {} --node 'a b'", yaml, folder / "a.mcap")),
                    "--node: 'a b'");
}

TEST_F(Program, FallingBehindIsSaidWhileItHappens) {
  const TemporaryFolder folder;
  const std::string yaml = folder / "s.yaml";
  ASSERT_EQ(run(fmt::format("scenario new {} -o {} --length 5", map(), yaml)).code, 0);
  std::string text = read_file(yaml);
  text.replace(text.find("duration: 0"), 11, "duration: 90000");
  write_file(yaml, text);
  // no machine flies a thousand seconds in one
  const Result result = run(fmt::format("fly {} -o {} --rate 1000", yaml, folder / "run"),
                            "timeout --foreground -s INT 4");
  expect_contains(result.err, "s behind: this machine manages a rate of");
  expect_contains(result.err, ", not 1000; mid360 takes ");
  expect_contains(result.err, " of a core, with --fidelity line about ");
  expect_contains(result.err, "; use fewer LiDARs");
}

TEST_F(Program, FidelityIsThatOfAllBeamsAndCostsAreSaid) {
  const TemporaryFolder folder;
  const auto scenario = [&](const char* name, int sub_rays) {
    write_file(folder / name,
               fmt::format("map: {}\nduration: 0.3\nlidars:\n  - {{model: mid360, sub_rays: {}}}\n"
                           "  - {{model: vlp16, sub_rays: {}}}\nvehicle: {{start: [12, 10, 2]}}\n",
                           map(),
                           sub_rays,
                           sub_rays));
  };
  scenario("s.yaml", -1);
  scenario("line.yaml", 1);
  scenario("wide.yaml", 0);
  const auto fly = [&](const std::string& name, const std::string& flags) {
    const std::string results = folder / (name + flags + ".run");
    const Result flown =
        run(fmt::format("fly {} -o {} --no-picture {}", folder / name, results, flags));
    EXPECT_EQ(flown.code, 0) << flown.err;
    expect_contains(flown.out, " of a core for a simulated second: ");
    return read_file(results + "/scans/0_000001.pcd") + read_file(results + "/scans/1_000002.pcd");
  };
  const std::string line = fly("s.yaml", "--fidelity=line");
  EXPECT_TRUE(line == fly("line.yaml", ""));
  const std::string wide = fly("s.yaml", "--fidelity=wide");
  EXPECT_TRUE(wide == fly("wide.yaml", ""));
  EXPECT_TRUE(wide != line);
  const std::string results = folder / "s.yaml--fidelity=line.run";
  expect_contains(read_file(results + "/scenario.yaml"), "sub_rays: 1");
  const auto timing = nlohmann::json::parse(read_file(results + "/timing.json"));
  ASSERT_EQ(timing["cost"]["lidars"].size(), 2u);
  double lidars = 0.0;
  for (const auto& lidar : timing["cost"]["lidars"]) {
    EXPECT_GT(lidar["cores"], 0.0) << lidar;
    lidars += lidar["cores"].get<double>();
  }
  EXPECT_GT(timing["cost"]["cores"], lidars);
  expect_user_error(
      run(fmt::format("fly {} -o {} --fidelity high", folder / "s.yaml", folder / "x")),
      "--fidelity");
}

TEST_F(Program, StartsWhereAPlannerCanPlan) {
  const TemporaryFolder folder;
  const std::string yaml = folder / "s.yaml";
  const Result made = run(
      fmt::format("scenario new {} -o {} --length 5 --start-in=2,2,0.5,20,18,1.7", map(), yaml));
  ASSERT_EQ(made.code, 0) << made.err;
  const std::string text = read_file(yaml);
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  ASSERT_EQ(std::sscanf(text.c_str() + text.find("start: ["), "start: [%lf, %lf, %lf]", &x, &y, &z),
            3);
  EXPECT_TRUE(x >= 2 && x <= 20 && y >= 2 && y <= 18 && z >= 0.5 && z <= 1.7);
  expect_user_error(
      run(fmt::format("scenario new {} -o {} --force --start-in=2,2,90,20,18,95", map(), yaml)),
      "`map import --shift` moves it");
  expect_user_error(
      run(fmt::format("scenario new {} -o {} --force --start-in=2,2,3,20,18,2", map(), yaml)),
      "--start-in: is empty");
  const Result outside =
      run(fmt::format("fly {} -o {} --start-in=-9,-9,0,-8,-8,1 --seed 1", yaml, folder / "run"));
  expect_contains(outside.err, "warning: drone0 starts at");
  // the ground of a map at z = 0
  const std::string moved = folder / "moved.pfmap";
  ASSERT_EQ(
      run(fmt::format("map import {} -o {} --resolution 0.1 --shift 100,-7,31", cloud(), moved))
          .code,
      0);
  const auto corner = [](const std::string& map_file) {
    const std::string info = run(fmt::format("map info {}", map_file)).out;
    Vector3d low = Vector3d::Zero();
    EXPECT_EQ(std::sscanf(info.c_str() + info.find("from ("),
                          "from (%lf, %lf, %lf)",
                          &low.x(),
                          &low.y(),
                          &low.z()),
              3);
    return low;
  };
  EXPECT_LT((corner(moved) - corner(map()) - Vector3d(100, -7, 31)).norm(), 0.3);  // cells
}

TEST_F(Program, EndsOneForAMissionCutShortAndForACollisionUnderStop) {
  const TemporaryFolder folder;
  write_file(folder / "s.yaml",
             fmt::format("map: {}\nduration: 1\nlidars: []\nvehicle:\n  start: [12, 10, 4]\n"
                         "mission:\n  waypoints:\n    - [12, 14, 4]\n",
                         map()));
  EXPECT_EQ(run(fmt::format("fly {} -o {}", folder / "s.yaml", folder / "a")).code, 1);
  // into the ground
  write_file(
      folder / "t.yaml",
      fmt::format("map: {}\nlidars: []\nvehicle:\n  start: [12, 10, 3]\n  on_collision: stop\n"
                  "mission:\n  waypoints:\n    - [12, 10, -3]\n",
                  map()));
  const Result crash = run(fmt::format("fly {} -o {}", folder / "t.yaml", folder / "b"));
  EXPECT_EQ(crash.code, 1);
  expect_contains(crash.err,
                  "t.yaml:8: warning: drone0's leg to waypoint 1 passes through the map");
  expect_contains(crash.err, "warning: collision at");
  const auto summary = nlohmann::json::parse(read_file(folder / "b/summary.json"));
  EXPECT_EQ(summary["end"], "collision");
}

TEST_F(Program, FliesASwarmAmongObstaclesAndDrawsItAgain) {
  const TemporaryFolder folder;
  write_file(folder / "s.yaml",
             fmt::format("map: {}\nduration: 0.5\nvehicles:\n  - {{name: a, start: [12, 10, 4], "
                         "copies: 2}}\n  - {{name: big, model: octo_1045, start: [12, 5, 5], "
                         "lidars: []}}\nobstacles:\n  - {{count: 3, radius: 0.2}}\noutput: "
                         "{{odometry: true}}\n",
                         map()));
  const Result fly = run(fmt::format("fly {} -o {}", folder / "s.yaml", folder / "run"));
  EXPECT_EQ(fly.code, 0) << fly.err;
  expect_contains(fly.out, "a1");
  for (const char* name : {"a0/trajectory.csv",
                           "a1/scans/0_000001.pcd",
                           "a1/odometry.csv",
                           "big/imu.csv",
                           "obstacles.csv",
                           "events.csv",
                           "overview.png"}) {
    EXPECT_FALSE(read_file(folder / (std::string("run/") + name)).empty()) << name;
  }
  const auto summary = nlohmann::json::parse(read_file(folder / "run/summary.json"));
  EXPECT_EQ(summary["vehicles"].size(), 3u);
  EXPECT_EQ(summary["vehicles"][2]["name"], "big");
  EXPECT_EQ(summary["obstacles"], 3);
  std::filesystem::remove(folder / "run/overview.png");
  const Result again = run(fmt::format("picture {} --map {}", folder / "run", map()));
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_FALSE(read_file(folder / "run/overview.png").empty());
  expect_user_error(run(fmt::format("picture {} --map {}", folder.path(), map())), "summary.json");
  write_file(
      folder / "t.yaml",
      fmt::format("map: {}\nvehicles:\n  - start: [12, 10, 4]\n  - start: [12, 10.2, 4]\n", map()));
  expect_user_error(run(fmt::format("fly {} -o {}", folder / "t.yaml", folder / "no")),
                    "t.yaml:4: vehicles[1].start: drone1 starts");
  EXPECT_FALSE(std::filesystem::exists(folder / "no"));
}

TEST_F(Program, ShowsVehicles) {
  const TemporaryFolder folder;
  const Result list = run("vehicle list");
  EXPECT_EQ(list.code, 0);
  for (const char* name : {"quad_250", "quad_330", "quad_450", "hexa_550", "octo_1045"}) {
    expect_contains(list.out, name);
  }
  const Result show = run(fmt::format("vehicle show hexa_550 --png {}", folder / "v.png"));
  EXPECT_EQ(show.code, 0) << show.err;
  expect_contains(show.out, "thrust to weight: 3.07");
  expect_contains(show.out, "position x");
  EXPECT_FALSE(read_file(folder / "v.png").empty());
  expect_user_error(run("vehicle show quad_333"), "did you mean 'quad_330'");
  expect_user_error(run("vehicle show quad_330 --controller lqr"), "one of: cascade, geometric");
}

TEST_F(Program, AFullDiskWhileFlyingIsSaid) {
  const TemporaryFolder folder;
  write_file(folder / "s.yaml",
             fmt::format("map: {}\nduration: 3\nvehicle:\n  start: [12, 10, 4]\n", map()));
  const Result full =
      run(fmt::format("fly {} -o {}", folder / "s.yaml", folder / "run"), "ulimit -f 64;");
  EXPECT_EQ(full.code, 2);
  expect_contains(full.err, "cannot write: File too large");
  EXPECT_FALSE(std::filesystem::exists(folder / "run"));
  expect_user_error(run(fmt::format("fly {} -o /proc/nowhere", folder / "s.yaml")),
                    "/proc/nowhere");
}

TEST_F(Program, AnInterruptClosesTheFilesAndEnds130) {
  const TemporaryFolder folder;
  write_file(folder / "s.yaml",
             fmt::format("map: {}\nduration: 100\nvehicle:\n  start: [12, 10, 4]\n", map()));
  const Result result =
      run(fmt::format("fly {} -o {} --rate 1.0", folder / "s.yaml", folder / "run"),
          "timeout --foreground --preserve-status -s INT 2");
  EXPECT_EQ(result.code, 130) << result.err;
  const auto summary = nlohmann::json::parse(read_file(folder / "run/summary.json"));
  EXPECT_EQ(summary["end"], "interrupted");
  // two seconds at real time, less if the machine is slow
  EXPECT_GT(summary["simulated_time"].get<double>(), 0.0);
  EXPECT_LT(summary["simulated_time"].get<double>(), 2.5);
  EXPECT_FALSE(read_file(folder / "run/trajectory.csv").empty());
}

}  // namespace
}  // namespace pointflight
