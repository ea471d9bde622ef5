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
