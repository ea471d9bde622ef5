#include "tests/integration/program.hpp"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

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

TEST_F(Program, HelpAndVersionEverywhere) {
  expect_contains(run("--version").out, "pointflight 0.");
  for (const char* command : {"",
                              "map",
                              "map import",
                              "map info",
                              "map forest",
                              "scan",
                              "compare",
                              "fidelity",
                              "fly",
                              "scenario new",
                              "scenario check",
                              "lidar list",
                              "lidar show"}) {
    const Result result = run(fmt::format("{} --help", command));
    EXPECT_EQ(result.code, 0) << command;
    expect_contains(result.out, "-h,--help");
  }
}

TEST_F(Program, WrongFlagsAreWrongInput) {
  expect_user_error(run(""), "a command is missing, one of: map, world, scenario, fly");
  expect_user_error(run("fly"), "scenario is required");
  expect_user_error(run("fly x.yaml -o /tmp/x --rate fast"), "--rate: 'fast'");
  expect_user_error(run(fmt::format("map import {} -o /tmp/x --resolution -1", cloud())),
                    "resolution");
  expect_user_error(run(fmt::format("scan {} --pose 1,2", map())),
                    "2 numbers where 6 are wanted: x,y,z,roll");
  expect_user_error(run(fmt::format("scan {} --pose 1,2,3,4,5,x", map())), "'x' is no number");
  expect_user_error(run(fmt::format("scan {} --lidar mid36 --pose 1,2,3,0,0,0", map())),
                    "did you mean 'mid360'");
  expect_user_error(run("frobnicate"), "");
}

TEST_F(Program, MapInfoSaysWhatIsInAMap) {
  const TemporaryFolder folder;
  const Result text = run(fmt::format("map info {} --verify --png {}", map(), folder / "m.png"));
  EXPECT_EQ(text.code, 0) << text.err;
  expect_contains(text.out, "checksums   match");
  EXPECT_EQ(read_file(folder / "m.png").substr(1, 3), "PNG");
  const auto json = nlohmann::json::parse(run(fmt::format("map info {} --json", map())).out);
  EXPECT_GT(json["surfels"].get<int>(), 10000);
  EXPECT_EQ(json["resolution"].get<double>(), 0.1);
  EXPECT_LT(json["bytes_per_surfel"].get<double>(), 15.5);
  EXPECT_GT(json["planar_share"].get<double>(), 0.3);
  EXPECT_EQ(json["made"]["sources"][0], "forest.pcd");
}

TEST_F(Program, Slow_ScansWithEverySensorAndBothRenderers) {
  const TemporaryFolder folder;
  for (const char* lidar :
       {"avia", "mid360", "vlp32c", "hdl64e", "os1_32", "os1_128", "d455", "marsim_grid"}) {
    for (const char* renderer : {"beam", "paper"}) {
      SCOPED_TRACE(fmt::format("{} {}", lidar, renderer));
      const Result result =
          run(fmt::format("scan {} --lidar {} --renderer {} --pose 12,10,1.5,0,10,45 --json "
                          "--force -o {} --png {}",
                          map(),
                          lidar,
                          renderer,
                          folder / "s.pcd",
                          folder / "s.png"));
      ASSERT_EQ(result.code, 0) << result.err;
      const auto json = nlohmann::json::parse(result.out);
      EXPECT_GT(json["points"].get<double>(), 0.05 * json["beams"].get<double>());
      expect_contains(read_file(folder / "s.pcd").substr(0, 400),
                      "x y z intensity range time ring");
      EXPECT_EQ(read_file(folder / "s.png").substr(1, 3), "PNG");
    }
  }
}

TEST_F(Program, SaysWhichCommandOrFlagWasMeant) {
  expect_user_error(run("flyy x"), "unknown command 'flyy', did you mean 'fly'?; see pointflight");
  expect_user_error(run("map improt a"), "did you mean 'import'?; see pointflight map --help");
  expect_user_error(run("map zzz"), "unknown command 'zzz', expected one of: import, info");
  expect_user_error(run("info x.pfmap"), "did you mean 'map info' or 'bag info' or 'gpu info'?");
  expect_user_error(run("map"), "a command is missing, one of: import, info");
  expect_user_error(run("fly x -o y --bogus --zeta 1"), "not expected: --bogus --zeta 1;");
  expect_user_error(run("scan x --lidr avia --pose 0"), "--lidr avia, did you mean '--lidar'?");
  for (const char* arguments : {"help", "help map import", "map import --help"}) {
    const Result help = run(arguments);
    EXPECT_EQ(help.code, 0);
    expect_contains(help.out, "Usage: pointflight");
  }
  // the tour is the program's, each command has an example of its own
  expect_contains(run("--help").out, "A first tour");
  expect_contains(run("fly --help").out, "Example: pointflight fly");
  EXPECT_EQ(run("fly --help").out.find("A first tour"), std::string::npos);
  const TemporaryFolder folder;
  write_file(folder / "hall.pcd", "");
  expect_user_error(run(fmt::format("fly {}", folder / "hall.pcd")),
                    "import it first: pointflight map import");
  expect_user_error(run(fmt::format("picture {}", folder / "nosuch")), "nosuch: no such folder");
  const Result version = run("--version");
  EXPECT_EQ(version.code, 0);
  for (const char* words : {"pointflight 0.", "(commit ", "meshes ", "ROS 1 ", "ROS 2 "}) {
    expect_contains(version.out, words);
  }
}

TEST_F(Program, ManualAndCompletionComeFromTheCommandTree) {
  const TemporaryFolder folder;
  const Result man = run("man");
  EXPECT_EQ(man.out.rfind(".TH POINTFLIGHT 1", 0), 0u);
  for (const char* words : {".SS pointflight map import", "\\-\\-resolution", "EXIT STATUS"}) {
    expect_contains(man.out, words);
  }
  write_file(folder / "completion", run("completion").out);
  const auto completed = [&](const std::string& words, int at) {
    const std::string script = fmt::format(
        "source {}; COMP_WORDS=({}); COMP_CWORD={}; _pointflight; echo \"${{COMPREPLY[*]}}\"",
        folder / "completion",
        words,
        at);
    write_file(folder / "script", script);
    EXPECT_EQ(std::system(fmt::format("bash {} >{}", folder / "script", folder / "out").c_str()),
              0);
    return read_file(folder / "out");
  };
  EXPECT_EQ(completed("pointflight sc", 1), "scenario scan\n");
  EXPECT_EQ(completed("pointflight map imp", 2), "import\n");
  EXPECT_EQ(completed("pointflight map import --resol", 3), "--resolution\n");
}

TEST_F(Program, FliesWhatTheCommandLineSays) {
  const TemporaryFolder folder;
  const Result fly = run(fmt::format(
      "fly {} --lidar avia --vehicle hexa_550 --start 12,10,9 --mission 12,12,9 -1,12,9 --duration "
      "0.3 --no-scans --json -o {}",
      map(),
      folder / "run"));
  EXPECT_EQ(fly.code, 0) << fly.err;  // the mission takes longer, and so long was asked for
  const auto json = nlohmann::json::parse(fly.out);
  EXPECT_EQ(json["vehicles"][0]["model"], "hexa_550");
  EXPECT_EQ(json["vehicles"][0]["scans"], 3);
  EXPECT_EQ(json["simulated_time"], 0.3);
  EXPECT_EQ(json["folder"], folder / "run");
  EXPECT_FALSE(std::filesystem::exists(folder / "run/scans"));
  for (const char* words : {"model: avia", "[12, 12, 9]", "[-1, 12, 9]", "duration: 0.3"}) {
    expect_contains(read_file(folder / "run/scenario.yaml"), words);
  }
  const Result again = run(fmt::format("fly {} --lidar mid360 --vehicle quad_330 -o {}",
                                       folder / "run/scenario.yaml",
                                       folder / "again"));
  EXPECT_EQ(again.code, 0) << again.err;
  expect_contains(read_file(folder / "again/scenario.yaml"), "model: mid360");
  expect_user_error(run(fmt::format("fly {} -o {} --mission 1,2", map(), folder / "no")),
                    "--mission: 2 numbers where 3 are wanted: x,y,z x,y,z");
  expect_user_error(run(fmt::format("fly {} -o {} --lockstep 1", map(), folder / "no")),
                    "--lockstep: has no effect without --ros1, --ros2 or --view");
  const Result check = run(fmt::format("scenario check {} --json", folder / "run/scenario.yaml"));
  EXPECT_EQ(nlohmann::json::parse(check.out)["vehicles"][0]["waypoints"], 2);
}

TEST_F(Program, TheSameScanForTheSameSeed) {
  const TemporaryFolder folder;
  const auto scan = [&](int seed, int threads) {
    const std::string path = folder / "s.pcd";
    run(fmt::format("scan {} --pose 12,10,1.5,0,0,0 --seed {} --threads {} --force -o {}",
                    map(),
                    seed,
                    threads,
                    path));
    return read_file(path);
  };
  const std::string first = scan(1, 1);
  EXPECT_GT(first.size(), 10000u);
  EXPECT_TRUE(first == scan(1, 2));
  EXPECT_TRUE(first == scan(1, 8));
  EXPECT_FALSE(first == scan(2, 1));
}

/// Little-endian bytes of numbers.
template <class... T>
std::string bytes_of(T... values) {
  std::string bytes;
  (bytes.append(reinterpret_cast<const char*>(&values), sizeof values), ...);
  return bytes;
}

TEST_F(Program, ImportsEveryFormatToTheSameMap) {
  // a wall of millimetre-exact points in each format
  const TemporaryFolder folder;
  std::string xyz;
  std::string ply;
  std::string las(227, '\0');
  std::uint32_t count = 0;
  for (std::int32_t j = 0; j < 60; ++j) {
    for (std::int32_t k = 0; k < 40; ++k, ++count) {
      xyz += fmt::format("3 {:.3f} {:.3f}\n", 0.025 * j, 0.025 * k);
      ply += bytes_of(3.0, 0.025 * j, 0.025 * k);
      las += bytes_of(std::int32_t{3000}, 25 * j, 25 * k) + std::string(8, '\0');
    }
  }
  las.replace(0, 4, "LASF");
  las.replace(24, 2, bytes_of(std::uint8_t{1}, std::uint8_t{2}));
  las.replace(94,
              17,
              bytes_of(std::uint16_t{227},
                       std::uint32_t{227},
                       std::uint32_t{0},
                       std::uint8_t{0},
                       std::uint16_t{20},
                       count));
  las.replace(131, 24, bytes_of(0.001, 0.001, 0.001));
  write_file(folder / "a.xyz", xyz);
  write_file(folder / "a.ply",
             fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double "
                         "x\nproperty double y\nproperty double z\nend_header\n",
                         count) +
                 ply);
  write_file(folder / "a.las", las);
  write_file(folder / "a.pcd",
             fmt::format("VERSION .7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH "
                         "{0}\nHEIGHT 1\nPOINTS {0}\nDATA binary\n",
                         count) +
                 ply);
  std::vector<nlohmann::json> infos;
  for (const char* name : {"a.xyz", "a.ply", "a.las", "a.pcd"}) {
    SCOPED_TRACE(name);
    const std::string map = folder / (std::string(name) + ".pfmap");
    const Result import =
        run(fmt::format("map import {} -o {} --resolution 0.1", folder / name, map));
    ASSERT_EQ(import.code, 0) << import.err;
    infos.push_back(nlohmann::json::parse(run(fmt::format("map info {} --json", map)).out));
    EXPECT_EQ(infos.back()["made"]["points_read"], count);
    const Result scan = run(
        fmt::format("scan {} --lidar marsim_grid --pose 2,0.75,0.5,0,0,0 --no-noise --json", map));
    EXPECT_EQ(scan.code, 0) << scan.err;
    EXPECT_EQ(infos.back()["surfels"], infos.front()["surfels"]);
  }
}

TEST_F(Program, TurnsYUpAndScales) {
  const TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 50; ++i) {
    for (int j = 0; j < 20; ++j) text += fmt::format("{} {} 0\n", 100 * i, 50 * j);  // mm, y up
  }
  write_file(folder / "a.xyz", text);
  const std::string map = folder / "a.pfmap";
  ASSERT_EQ(
      run(fmt::format("map import {} -o {} --scale 0.001 --up y", folder / "a.xyz", map)).code, 0);
  const auto info = nlohmann::json::parse(run(fmt::format("map info {} --json", map)).out);
  EXPECT_NEAR(info["max"][0].get<double>() - info["min"][0].get<double>(), 4.9, 0.2);
  EXPECT_NEAR(info["max"][1].get<double>() - info["min"][1].get<double>(), 0.0, 0.2);
  EXPECT_NEAR(info["max"][2].get<double>() - info["min"][2].get<double>(), 0.95, 0.2);
}

TEST_F(Program, ExportsTheOutliersThatItDropped) {
  const TemporaryFolder folder;
  const Result import = run(
      fmt::format("map import {} -o {} --resolution 0.1 --export-outliers {} --outlier-sigmas 1",
                  cloud(),
                  folder / "a.pfmap",
                  folder / "dropped.pcd"));
  ASSERT_EQ(import.code, 0) << import.err;
  const auto info =
      nlohmann::json::parse(run(fmt::format("map info {} --json", folder / "a.pfmap")).out);
  const auto dropped = info["made"]["outlier_removal"]["cells_dropped"].get<int>();
  EXPECT_GT(dropped, 0);
  expect_contains(read_file(folder / "dropped.pcd"), fmt::format("POINTS {}\n", dropped));
}

TEST_F(Program, ImportsEveryBadCloudWithOneLine) {
  const TemporaryFolder folder;
  const auto import = [&](const std::string& name, const std::string& bytes) {
    if (name != "absent.pcd") write_file(folder / name, bytes);
    const Result result =
        run(fmt::format("map import {} -o {}", folder / name, folder / "o.pfmap"));
    EXPECT_FALSE(std::filesystem::exists(folder / "o.pfmap"));
    EXPECT_FALSE(std::filesystem::exists(folder / "o.pfmap.partial"));
    return result;
  };
  const std::string header =
      "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {0}\nHEIGHT 1\n"
      "POINTS {0}\nDATA {1}\n";
  const auto pcd = [&](const char* points, const char* data) {
    return fmt::format(fmt::runtime(header), points, data);
  };
  expect_user_error(import("absent.pcd", ""), "No such file");
  expect_user_error(import("empty.pcd", ""), "the file is empty");
  expect_user_error(import("none.pcd", pcd("0", "ascii")), "no points");
  expect_user_error(import("nan.pcd", pcd("2", "ascii") + "nan nan nan\n1 2 nan\n"),
                    "all 2 points are NaN");
  expect_user_error(import("billion.pcd", pcd("1000000000", "binary") + "abc"),
                    "promises 1000000000 points");
  expect_user_error(import("cut.pcd", pcd("3", "ascii") + "1 2 3\n"), "cut.pcd:10");
  expect_user_error(import("type.pcd", "FIELDS x y z\nSIZE 4 4 4\nTYPE F F C\n"), "TYPE 'C'");
  expect_user_error(import("a.laz", "LASF"), "laszip -i");
  expect_user_error(import("a.docx", "x"), "these are read: .pcd");
  expect_user_error(import("few.xyz", "1 2 3\n4 5 6\n"), "give --resolution");
}

TEST_F(Program, RefusesDamagedMaps) {
  const TemporaryFolder folder;
  const std::string good = read_file(map());
  write_file(folder / "cut.pfmap", good.substr(0, good.size() / 2));
  expect_user_error(run(fmt::format("map info {}", folder / "cut.pfmap")), "does not lie inside");
  std::string flipped = good;
  flipped[good.size() / 2] = static_cast<char>(flipped[good.size() / 2] ^ 1);
  write_file(folder / "flip.pfmap", flipped);
  expect_user_error(run(fmt::format("map info {} --verify", folder / "flip.pfmap")), "checksum");
  expect_user_error(run(fmt::format("map info {}", cloud())), "pointflight map import");
  expect_user_error(run("map info /absent.pfmap"), "No such file");
}

TEST_F(Program, NothingIsLeftWhereAFileCannotBeWritten) {
  const TemporaryFolder folder;
  expect_user_error(run(fmt::format("map import {} -o /nowhere/x.pfmap --resolution 0.1", cloud())),
                    "/nowhere/x.pfmap: cannot write");
  // a file-size limit of 512 kB stands for a full disk
  const Result full =
      run(fmt::format("map import {} -o {} --resolution 0.1", cloud(), folder / "x.pfmap"),
          "ulimit -f 512;");
  expect_contains(full.err, "x.pfmap: cannot write: File too large");
  EXPECT_EQ(full.code, 2);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST_F(Program, RefusesToOverwriteWhatItReads) {
  const TemporaryFolder folder;
  const std::string copy = folder / "c.pcd";
  std::filesystem::copy_file(cloud(), copy);
  expect_user_error(run(fmt::format("map import {} -o {}", copy, copy)), "another name");
  expect_user_error(run(fmt::format("map import {} -o {} --export-outliers {}",
                                    copy,
                                    folder / "m.pfmap",
                                    folder / "m.pfmap")),
                    "another name");
  expect_user_error(run(fmt::format("map import {} -o {}", copy, folder.path())),
                    "not a regular file");
  EXPECT_EQ(read_file(copy), read_file(cloud()));
}

TEST_F(Program, AnInterruptedImportLeavesNothing) {
  const TemporaryFolder folder;
  const Result result = run(fmt::format("map forest -o {}", folder / "f.pcd"));
  ASSERT_EQ(result.code, 0);
  const Result import = run(
      fmt::format(
          "map import {0} {0} {0} -o {1} --resolution 0.02", folder / "f.pcd", folder / "f.pfmap"),
      "timeout --foreground --preserve-status -s INT 0.3");
  EXPECT_EQ(import.code, 130) << import.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "f.pfmap"));
  EXPECT_FALSE(std::filesystem::exists(folder / "f.pfmap.partial"));
}

TEST_F(Program, AFullTerminalIsNoCrash) {
  const Result lost = run(fmt::format("map info {} --json >/dev/full #", map()));
  EXPECT_EQ(lost.code, 2);
  EXPECT_EQ(run("map info nothing.pfmap 2>/dev/full #").code, 2);
}

}  // namespace
}  // namespace pointflight
