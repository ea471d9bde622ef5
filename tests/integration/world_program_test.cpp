#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/integration/program.hpp"

namespace pointflight {
namespace {

using testing::expect_contains;
using testing::expect_user_error;
using testing::read_file;
using testing::Result;
using testing::run;
using testing::TemporaryFolder;
using testing::write_file;

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

/// Lines of a CSV as words.
std::vector<std::vector<std::string>> rows_of(const std::string& csv) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string>& row = rows.emplace_back();
    std::istringstream words(line);
    for (std::string word; std::getline(words, word, ',');) row.push_back(word);
  }
  return rows;
}

TEST(WorldProgram, RaysAreCastIntoMapsAndIntoWhatIsExact) {
  const TemporaryFolder folder;
  const std::string map = folder / "office.pfmap";
  ASSERT_EQ(run("world make large_office -o " + map + " --resolution 0.1").code, 0);
  std::string rays = "# a fan, as text\n";
  for (int i = 0; i < 200; ++i) {
    const double a = 0.0314 * i;
    rays += fmt::format("20 8 1.5  {} {} {}\n", std::cos(a), std::sin(a), 0.003 * (i % 50));
  }
  write_file(folder / "rays.txt", rays);
  const auto cast = [&](const std::string& words) {
    const Result result = run("raycast " + words);
    EXPECT_EQ(result.code, 0) << result.err;
    return rows_of(result.out);
  };
  const std::string file = " " + (folder / "rays.txt");
  const auto exact = cast(map + file + " --exact");
  EXPECT_EQ(exact, cast("large_office" + file + " --exact"));
  const auto in_map = cast(map + file);
  ASSERT_EQ(exact.size(), 201u);
  ASSERT_EQ(in_map.size(), 201u);
  EXPECT_EQ(exact[0][0], "range");
  std::size_t near = 0;
  std::size_t same = 0;
  for (std::size_t i = 1; i < exact.size(); ++i) {
    if (exact[i][0] == "inf" || in_map[i][0] == "inf") continue;
    if (std::abs(std::stod(exact[i][0]) - std::stod(in_map[i][0])) > 0.05) continue;
    ++near;
    // class and thing, but for where things touch each other
    same += exact[i][3] == in_map[i][3] && exact[i][4] == in_map[i][4] ? 1 : 0;
  }
  EXPECT_GT(near, 140u);
  EXPECT_GT(static_cast<double>(same), 0.95 * static_cast<double>(near));

  const auto truth = nlohmann::json::parse(read_file(folder / "office.truth"));
  EXPECT_EQ(truth["world"], "large_office");
  EXPECT_GT(truth["things"].size(), 50u);
  EXPECT_EQ(truth["classes"][0]["name"], "wall");

  // the truth of points says the same
  ASSERT_EQ(run("scan " + map + " --lidar vlp16 --pose 20,8,1.5,0,0,0 --truth -o " +
                (folder / "scan.pcd"))
                .code,
            0);
  expect_contains(read_file(folder / "scan.pcd").substr(0, 600),
                  "surfel thing sub_ray sub_rays assumed class");

  expect_user_error(run("raycast large_office " + (folder / "none.txt")), "No such file");
  write_file(folder / "bad.txt", "1 2 3\n");
  expect_user_error(run("raycast large_office " + (folder / "bad.txt")), "bad.txt:1: a ray is six");
  write_file(folder / "bad.txt", "1 2 3 0 0 1 7\n");
  expect_user_error(run("raycast large_office " + (folder / "bad.txt")), "more than the six");
  write_file(folder / "bad.txt", "1 2 3 0 0 0\n");
  expect_user_error(run("raycast large_office " + (folder / "bad.txt")), "has no length");
  ASSERT_EQ(run("map forest -o " + (folder / "f.pcd") + " --trees 20").code, 0);
  ASSERT_EQ(
      run("map import " + (folder / "f.pcd") + " --resolution 0.2 -o " + (folder / "f.pfmap")).code,
      0);
  expect_user_error(run("raycast " + (folder / "f.pfmap") + file + " --exact"), "world make");
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
