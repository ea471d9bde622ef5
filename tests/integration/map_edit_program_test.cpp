#include <sys/stat.h>

#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>

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

class MapEdit : public Program {
 protected:
  static nlohmann::json info(const std::string& map) {
    return nlohmann::json::parse(run(fmt::format("map info {} --json --verify", map)).out);
  }
  static void expect_done(const std::string& arguments) {
    const Result result = run(arguments);
    EXPECT_EQ(result.code, 0) << arguments << "\n" << result.err;
  }
};

TEST_F(MapEdit, CropsMapsAndClouds) {
  const TemporaryFolder folder;
  expect_done(fmt::format("map crop {} -o {} --box 5,5,-2,15,15,30 --png {}",
                          map(),
                          folder / "a.pfmap",
                          folder / "a.png"));
  const auto cropped = info(folder / "a.pfmap");
  EXPECT_GE(cropped["min"][0].get<double>(), 5.0);
  EXPECT_LE(cropped["max"][1].get<double>(), 15.0);
  EXPECT_EQ(cropped["made"]["edited"][0], "crop --box 5,5,-2,15,15,30");
  EXPECT_EQ(read_file(folder / "a.png").substr(1, 3), "PNG");
  // crowns cut away, of the cloud and of the map alike
  expect_done(fmt::format("map crop {} -o {} --max-height 2", map(), folder / "low.pfmap"));
  expect_done(fmt::format("map crop {} -o {} --max-height 2", cloud(), folder / "low.ply"));
  expect_done(fmt::format(
      "map import {} -o {} --resolution 0.1", folder / "low.ply", folder / "low2.pfmap"));
  EXPECT_LT(info(folder / "low.pfmap")["max"][2].get<double>(), 4.5);
  EXPECT_NEAR(info(folder / "low.pfmap")["max"][2].get<double>(),
              info(folder / "low2.pfmap")["max"][2].get<double>(),
              0.5);
  expect_done(fmt::format(
      "map crop {} -o {} --polygon 0,0,10,0,0,10 --outside", cloud(), folder / "corner.las"));
  expect_user_error(run(fmt::format("map crop {} -o {}", map(), folder / "b.pfmap")),
                    "nothing says what to keep");
  expect_user_error(
      run(fmt::format("map crop {} -o {} --box 90,90,90,99,99,99", map(), folder / "b.pfmap")),
      "nothing is left");
  expect_user_error(
      run(fmt::format("map crop {} -o {} --box 90,90,90,99,99,99", cloud(), folder / "b.pcd")),
      "no point is left");
  expect_user_error(run(fmt::format("map crop {} -o {} --box 1,2,3", cloud(), folder / "b.pcd")),
                    "--box: 3 numbers where 6 are wanted: x,y,z of the lower corner");
  expect_user_error(
      run(fmt::format("map crop {} -o {} --max-height 2", cloud(), folder / "b.pfmap")),
      "map import");
  expect_user_error(run(fmt::format("map crop {} -o {} --max-height 2", map(), folder / "b.pcd")),
                    "map export");
  expect_user_error(run(fmt::format("map crop {0} -o {0} --max-height 2", map())), "another name");
  for (const char* name : {"b.pfmap", "b.pcd", "b.pcd.partial", "b.pfmap.partial"}) {
    EXPECT_FALSE(std::filesystem::exists(folder / name)) << name;
  }
}

TEST_F(MapEdit, NothingIsOverwrittenWithoutForce) {
  const TemporaryFolder folder;
  write_file(folder / "there.pfmap", "mine");
  write_file(folder / "there.ply", "mine");
  write_file(folder / "there.png", "mine");
  for (const std::string& arguments :
       {fmt::format("crop {} -o {} --max-height 2", map(), folder / "there.pfmap"),
        fmt::format("transform {} -o {} --origin 1,2,3", map(), folder / "there.pfmap"),
        fmt::format("merge {0} {0} -o {1}", map(), folder / "there.pfmap"),
        fmt::format("export {} -o {}", map(), folder / "there.ply"),
        fmt::format("thin {} -o {} --every 2", cloud(), folder / "there.ply"),
        fmt::format("diff {0} {0} -o {1}", map(), folder / "there.ply"),
        fmt::format("diff {0} {0} --png {1}", map(), folder / "there.png")}) {
    SCOPED_TRACE(arguments);
    expect_user_error(run("map " + arguments), "is there already; give another name or --force");
  }
  EXPECT_EQ(read_file(folder / "there.pfmap"), "mine");
  expect_done(fmt::format("map export {} -o {} --force", map(), folder / "there.ply"));
  EXPECT_EQ(read_file(folder / "there.ply").substr(0, 3), "ply");
}

TEST_F(MapEdit, ThinsClouds) {
  const TemporaryFolder folder;
  const auto points = [&](const std::string& path) {
    expect_done(fmt::format("map import {} -o {} --resolution 0.2", path, folder / "x.pfmap"));
    const auto read = info(folder / "x.pfmap")["made"]["points_read"].get<double>();
    std::filesystem::remove(folder / "x.pfmap");
    return read;
  };
  expect_done(fmt::format("map thin {} -o {} --every 4", cloud(), folder / "a.pcd"));
  EXPECT_NEAR(points(folder / "a.pcd"), points(cloud()) / 4.0, 1.0);
  expect_done(fmt::format("map thin {} -o {} --spacing 0.1", cloud(), folder / "b.las"));
  EXPECT_LT(points(folder / "b.las"), points(cloud()));
  EXPECT_GT(points(folder / "b.las"), 10000.0);
  expect_user_error(run(fmt::format("map thin {} -o {}", cloud(), folder / "c.pcd")), "--every");
  expect_user_error(run(fmt::format("map thin {} -o {} --spacing 1", map(), folder / "c.pfmap")),
                    "coarser --resolution");
}

TEST_F(MapEdit, TransformsAndLevels) {
  const TemporaryFolder folder;
  expect_done(fmt::format("map transform {} -o {} --origin 12,10,0", map(), folder / "a.pfmap"));
  EXPECT_NEAR(info(folder / "a.pfmap")["min"][0].get<double>(),
              info(map())["min"][0].get<double>() - 12.0,
              1e-6);
  // a hall that is tilted and level again
  std::string hall;
  for (int i = 0; i < 120; ++i) {
    for (int j = 0; j < 80; ++j) {
      hall += fmt::format("{:.3f} {:.3f} 1.5\n", 0.1 * i, 0.1 * j);
      if (j < 30) hall += fmt::format("{:.3f} 0 {:.3f}\n", 0.1 * i, 1.5 + 0.1 * j);
      if (i < 30) hall += fmt::format("0 {:.3f} {:.3f}\n", 0.1 * j, 1.5 + 0.1 * i);
    }
  }
  write_file(folder / "hall.xyz", hall);
  expect_done(fmt::format(
      "map transform {} -o {} --pose 0,0,0,3,4,30", folder / "hall.xyz", folder / "tilted.ply"));
  const Result tilted =
      run(fmt::format("map import {} -o {}", folder / "tilted.ply", folder / "tilted.pfmap"));
  expect_contains(tilted.err, "warning: the floor is tilted by 5.0 degrees and the walls with it");
  for (const char* kind : {"ply", "pfmap"}) {
    const std::string level = folder / fmt::format("level.{}", kind);
    const Result result = run(fmt::format("map transform {} -o {} --level --ground-zero",
                                          folder / fmt::format("tilted.{}", kind),
                                          level));
    expect_contains(result.err, "tilted by 5.0");
    const std::string imported = folder / fmt::format("level_{}.pfmap", kind);
    if (kind == std::string("ply")) {
      const Result again = run(fmt::format("map import {} -o {}", level, imported));
      EXPECT_EQ(again.err.find("warning"), std::string::npos) << again.err;
    } else {
      std::filesystem::rename(level, imported);
    }
    EXPECT_NEAR(info(imported)["min"][2].get<double>(), 0.0, 0.05);
    EXPECT_NEAR(info(imported)["max"][2].get<double>(), 2.9, 0.15);
  }
  write_file(folder / "matrix.txt", "0 -1 0 5\n1 0 0 0\n0 0 1 0\n0 0 0 1\n");
  expect_done(fmt::format(
      "map transform {} -o {} --matrix {}", map(), folder / "turned.pfmap", folder / "matrix.txt"));
  EXPECT_NEAR(info(folder / "turned.pfmap")["max"][0].get<double>(),
              5.0 - info(map())["min"][1].get<double>(),
              0.01);
  const auto refused = [&](const std::string& flags, const char* words) {
    expect_user_error(
        run(fmt::format("map transform {} -o {} {}", map(), folder / "b.pfmap", flags)), words);
  };
  refused("", "nothing says how to move");
  refused("--scale 2", "cannot be scaled");
  refused("--matrix '1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1'", "mirrors");
  refused("--matrix '1 0.5 0 0 0 1 0 0 0 0 1 0 0 0 0 1'", "shears");
  refused("--matrix '1 2 3'", "3 numbers where 16 are wanted: 4 x 4");
  refused("--pose 1,2,x,0,0,0", "'x' is no number");
}

TEST_F(MapEdit, Slow_MergesExportsAndCompares) {
  const TemporaryFolder folder;
  expect_done(fmt::format("map crop {} -o {} --box 0,0,-9,12,20,99", map(), folder / "l.pfmap"));
  expect_done(fmt::format("map crop {} -o {} --box 12,0,-9,24,20,99", map(), folder / "r.pfmap"));
  expect_done(fmt::format(
      "map merge {} {} -o {}", folder / "l.pfmap", folder / "r.pfmap", folder / "both.pfmap"));
  const auto same = nlohmann::json::parse(
      run(fmt::format("map diff {} {} --json", map(), folder / "both.pfmap")).out);
  EXPECT_LT(same["only_in_first"]["share"].get<double>(), 0.003);
  EXPECT_EQ(same["only_in_second"]["missing"], 0);
  const Result half = run(fmt::format("map diff {} {} -o {} --png {}",
                                      map(),
                                      folder / "l.pfmap",
                                      folder / "d.ply",
                                      folder / "d.png"));
  EXPECT_EQ(half.code, 0) << half.err;
  expect_contains(half.out, "only in " + map());
  expect_contains(half.out, "0 of ");
  expect_contains(read_file(folder / "d.ply").substr(0, 400), "property uchar red");
  EXPECT_EQ(read_file(folder / "d.png").substr(1, 3), "PNG");
  // the same cloud twice, the second beside the first
  expect_done(fmt::format("map merge {0} {0} -o {1} --pose 0,0,0,0,0,0 --pose -30,0,0,0,0,90",
                          cloud(),
                          folder / "twice.pcd"));
  expect_user_error(
      run(fmt::format("map merge {0} {0} -o {1} --pose 0,0,0,0,0,0", cloud(), folder / "x.pcd")),
      "1 poses for 2 inputs");
  for (const char* name : {"e.pcd", "e.ply", "e.las"}) {
    expect_done(fmt::format("map export {} -o {} --density 300", map(), folder / name));
    const Result back = run(fmt::format("map diff {} {} --json", map(), folder / name));
    ASSERT_EQ(back.code, 0) << back.err;
    const auto json = nlohmann::json::parse(back.out);
    EXPECT_LT(json["only_in_first"]["share"].get<double>(), 0.005) << name;
    EXPECT_LT(json["only_in_second"]["share"].get<double>(), 0.005) << name;
  }
  expect_done(fmt::format("map export {} -o {} --what surfels", map(), folder / "s.ply"));
  expect_contains(read_file(folder / "s.ply").substr(0, 700),
                  "property float qz\nproperty uint surfel\n");
  expect_user_error(run(fmt::format("map export {} -o {} --what normals", map(), folder / "n.las")),
                    "LAS");
  expect_user_error(run(fmt::format("map export {} -o {}", map(), folder / "n.xyz")),
                    ".pcd, .ply or .las");
}

TEST_F(MapEdit, ADamagedMapIsNotEdited) {
  const TemporaryFolder folder;
  std::string bytes = read_file(map());
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x55);
  write_file(folder / "bad.pfmap", bytes);
  expect_user_error(
      run(fmt::format(
          "map crop {} -o {} --max-height 2", folder / "bad.pfmap", folder / "a.pfmap")),
      "checksum");
  EXPECT_FALSE(std::filesystem::exists(folder / "a.pfmap"));
}

TEST_F(MapEdit, Slow_ACloudFromStandardInput) {
  const TemporaryFolder folder;
  const std::string feed = fmt::format("cat {} |", cloud());
  const Result result =
      run(fmt::format("map import - -o {} --resolution 0.1", folder / "a.pfmap"), feed);
  ASSERT_EQ(result.code, 0) << result.err;
  expect_done(fmt::format("map import {} -o {} --resolution 0.1", cloud(), folder / "b.pfmap"));
  EXPECT_EQ(info(folder / "a.pfmap")["surfels"], info(folder / "b.pfmap")["surfels"]);
  EXPECT_EQ(run(fmt::format("map thin - -o {} --every 3", folder / "a.ply"), feed).code, 0);
  expect_user_error(run(fmt::format("map import - -o {}", folder / "c.pfmap"), "true |"),
                    "nothing came");
  expect_user_error(run(fmt::format("map import - - -o {}", folder / "c.pfmap"), feed), "once");
  // a signal is heard while nothing comes; in the foreground timeout sends no SIGCONT, which would
  // stop the leak sanitizer in its tracks
  const Result ended = run(fmt::format("map import - -o {}", folder / "c.pfmap"),
                           "sleep 20 | timeout --foreground -s INT 1");
  EXPECT_EQ(ended.err, "pointflight: interrupted\n");
  EXPECT_FALSE(std::filesystem::exists(folder / "c.pfmap"));
  EXPECT_FALSE(std::filesystem::exists(folder / "c.pfmap.partial"));
}

TEST_F(MapEdit, PipesAndDevicesAreRefusedWhereverAFileIsRead) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "run");
  for (const char* name : {"f.pcd",
                           "f.obj",
                           "f.ply",
                           "f.pfmap",
                           "f.yaml",
                           "f.csv",
                           "f.tum",
                           "f.mcap",
                           "f.bag",
                           "run/summary.json"}) {
    ASSERT_EQ(::mkfifo((folder / name).c_str(), 0600), 0);
  }
  write_file(folder / "s.yaml", fmt::format("map: {}\nvehicles:\n  - trajectory: f.csv\n", map()));
  const auto in = [&](const char* name) { return folder / name; };
  for (const std::string& arguments :
       {fmt::format("map import {} -o {}", in("f.pcd"), in("o.pfmap")),
        fmt::format("map import {} -o {}", in("f.obj"), in("o.pfmap")),
        fmt::format("map import {} -o {}", in("f.ply"), in("o.pfmap")),
        fmt::format("map import /dev/zero --format pcd -o {}", in("o.pfmap")),
        fmt::format("map info {}", in("f.pfmap")),
        fmt::format("map crop {} -o {} --max-height 1", in("f.pcd"), in("o.pcd")),
        fmt::format("map diff {} {}", in("f.pfmap"), map()),
        fmt::format("map merge {0} {0} -o {1} --poses {2}", map(), in("o.pfmap"), in("f.tum")),
        fmt::format("scan {} --pose 0,0,0,0,0,0", in("f.pfmap")),
        fmt::format("scan {} --pose 0,0,0,0,0,0 --lidar {}", map(), in("f.yaml")),
        fmt::format("fly {} -o {}", in("f.yaml"), in("o")),
        fmt::format("scenario check {}", in("f.yaml")),
        fmt::format("lidar show {}", in("f.yaml")),
        fmt::format("vehicle show {}", in("f.yaml")),
        fmt::format("picture {} --map {}", in("run"), map()),
        fmt::format("bag info {}", in("f.mcap")),
        fmt::format("bag info {}", in("f.bag"))}) {
    SCOPED_TRACE(arguments);
    expect_user_error(run(arguments, "timeout 20"), "not a regular file");
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "o.pfmap"));
}

TEST_F(MapEdit, ADamagedMeshIsOneLine) {
  const TemporaryFolder folder;
  write_file(folder / "a.ply",
             "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
             "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
             "end_header\n0 0 0\n1 0 0\n0 1 0\n0\n");
  expect_user_error(run(fmt::format("map import {} -o {}", folder / "a.ply", folder / "a.pfmap")),
                    "a.ply: ");
  EXPECT_FALSE(std::filesystem::exists(folder / "a.pfmap"));
}

TEST_F(MapEdit, NumbersAreWordsOfThisWorld) {
  const Result forest = run(fmt::format("map info {}", map()));
  EXPECT_EQ(forest.out.find("-0.00"), std::string::npos) << forest.out;
  const TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 2000; ++i) {
    text += fmt::format("{:.3f} {:.3f} {:.4f}\n", 0.1 * (i % 50), 0.1 * (i / 50), -0.002);
  }
  write_file(folder / "a.xyz", text);
  expect_done(
      fmt::format("map import {} -o {} --resolution 0.25", folder / "a.xyz", folder / "a.pfmap"));
  const Result flat = run(fmt::format("map info {}", folder / "a.pfmap"));
  EXPECT_EQ(flat.out.find("-0.00"), std::string::npos) << flat.out;
  expect_contains(run(fmt::format("map import {} -o {} --scale 1e9 --resolution 0.1",
                                  folder / "a.xyz",
                                  folder / "b.pfmap"))
                      .err,
                  "--scale");
  EXPECT_FALSE(std::filesystem::exists(folder / "b.pfmap"));
}

TEST_F(MapEdit, HelpOfEveryCommandHasAnExample) {
  for (const char* command : {"crop", "thin", "transform", "merge", "export", "diff"}) {
    const Result result = run(fmt::format("map {} --help", command));
    EXPECT_EQ(result.code, 0);
    expect_contains(result.out, fmt::format("pointflight map {} ", command));
    expect_contains(result.out, "--force");
    expect_contains(result.out, "--png");
  }
}

}  // namespace
}  // namespace pointflight
