#include <nlohmann/json.hpp>

#include "tests/integration/program.hpp"

namespace pointflight {
namespace {

using testing::expect_contains;
using testing::expect_user_error;
using testing::read_file;
using testing::Result;
using testing::run;
using testing::TemporaryFolder;

TEST(WorldProgram, ListsAndShowsAndMakes) {
  const auto worlds = nlohmann::json::parse(run("world list --json").out);
  EXPECT_EQ(worlds.size(), 18u);
  expect_contains(run("world list").out, "historical_building");
  const auto shown = nlohmann::json::parse(run("world show warehouse --seed 3 --json").out);
  EXPECT_EQ(shown["parameters"]["aisle"]["low"], 3.0);
  expect_contains(run("world show warehouse --set aisle=3.5").out, "3.5");
  const TemporaryFolder folder;
  const std::string map = folder / "a.pfmap";
  const Result made = run(fmt::format(
      "world make indoor_1 -o {} --resolution 0.2 --seed 2 --png {}", map, folder / "a.png"));
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(made.out, map + "\n");
  EXPECT_EQ(read_file(folder / "a.png").substr(1, 3), "PNG");
  ASSERT_EQ(
      run(fmt::format("world make indoor_1 -o {} --resolution 0.2 --seed 2", folder / "b.pfmap"))
          .code,
      0);
  EXPECT_EQ(read_file(map), read_file(folder / "b.pfmap"));
  EXPECT_EQ(run(fmt::format("map info {} --verify", map)).code, 0);
  const Result scan =
      run(fmt::format("scan {} --pose 8,6,2 --lidar mid360 -o {}", map, folder / "s.pcd"));
  EXPECT_EQ(scan.code, 0) << scan.err;
}

TEST(WorldProgram, TasksAreScenariosThatFly) {
  const TemporaryFolder folder;
  const std::string tasks = "world tasks indoor_1 --seed 2 --count 1 --resolution 0.2";
  const Result found = run(fmt::format("{} --json --scenarios {}", tasks, folder.path()));
  ASSERT_EQ(found.code, 0) << found.err;
  const auto json = nlohmann::json::parse(found.out);
  ASSERT_EQ(json["tasks"].size(), 3u);
  EXPECT_GT(json["explore"]["flyable"], 0.6);
  EXPECT_GE(json["tasks"][0]["length"], json["tasks"][0]["straight"]);
  expect_contains(run(tasks).out, "medium_1");
  // and as they are flown: the world is made again, to the same bytes
  const std::string flown = folder / "run";
  const Result flight =
      run(fmt::format("fly {} -o {} --no-scans --json", folder / "easy_1.yaml", flown));
  ASSERT_EQ(flight.code, 0) << flight.err;
  const auto summary = nlohmann::json::parse(flight.out);
  EXPECT_EQ(summary["end"], "completed");
  EXPECT_EQ(summary["map"], "indoor_1:2 at 0.2 m");
  EXPECT_EQ(summary["vehicles"][0]["collisions"], 0);
  const std::string copy = read_file(flown + "/scenario.yaml");
  expect_contains(copy, "world: indoor_1");
  expect_contains(copy, summary["map_hash"].get<std::string>());
  EXPECT_EQ(run(fmt::format("picture {} -o {}", flown, folder / "again.png")).code, 0);
  expect_user_error(run(fmt::format("{} --scenarios {}", tasks, folder / "easy_1.yaml/x")),
                    "easy_1.yaml");
  // scenarios of others stay
  expect_user_error(run(fmt::format("{} --scenarios {}", tasks, folder.path())), "--force");
}

TEST(WorldProgram, FliesAWorldByItsName) {
  const TemporaryFolder folder;
  const Result made =
      run(fmt::format("scenario new simple_garage:3 -o {} --length 10", folder / "garage.yaml"));
  ASSERT_EQ(made.code, 0) << made.err;
  expect_contains(read_file(folder / "garage.yaml"), "world: simple_garage");
  const std::string key = fmt::format("{}", folder / "key.yaml");
  const auto error_with = [&](const std::string& keys) {
    testing::write_file(key, "map: {" + keys + "}\n");
    return run("scenario check " + key);
  };
  expect_user_error(error_with("world: office"), "key.yaml:1: map.world: 'office'");
  expect_user_error(error_with("seed: 3"), "map.world");
  expect_user_error(error_with("world: mine, size: 3"), "map.size");
  expect_user_error(error_with("world: mine, resolution: 9"), "map.resolution");
  expect_user_error(error_with("world: mine, set: {width: 90}"), "width is 90");
  expect_user_error(run("fly mine:x -o " + (folder / "run")), "a seed is a whole number");
}

TEST(WorldProgram, Slow_ASurveyIsAMapWithScans) {
  const TemporaryFolder folder;
  const std::string map = folder / "s.pfmap";
  const std::string scans = folder / "scans";
  const Result made =
      run(fmt::format("world make indoor_1 -o {} --survey --speed 10 --resolution 0.15 "
                      "--scans {}",
                      map,
                      scans));
  ASSERT_EQ(made.code, 0) << made.err;
  expect_contains(made.err, "of the survey's rays");
  EXPECT_EQ(run(fmt::format("map info {} --verify", map)).code, 0);
  // what a user makes of the same scans is nearly the same map
  const Result imported =
      run(fmt::format("map import --scans {0}/scans --poses {0}/poses.tum -o {1} --resolution 0.15",
                      scans,
                      folder / "i.pfmap"));
  EXPECT_EQ(imported.code, 0) << imported.err;
}

TEST(WorldProgram, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  const std::string map = folder / "a.pfmap";
  expect_user_error(run("world make nowhere -o " + map), "world 'nowhere' is unknown");
  expect_user_error(run("world make mine --set width=12 -o " + map), "width is 12");
  expect_user_error(run("world make mine --set width -o " + map), "NAME=VALUE");
  expect_user_error(run("world show mine --set size=3"), "no parameter 'size'");
  testing::write_file(map, "mine");
  expect_user_error(run("world make mine -o " + map), "--force");
  EXPECT_EQ(read_file(map), "mine");
}

}  // namespace
}  // namespace pointflight
