#include <csignal>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "pointflight/core/resources.hpp"
#include "tests/integration/program.hpp"

/// What runs and recordings leave behind, also if things go wrong.
namespace pointflight {
namespace {

namespace fs = std::filesystem;
using testing::expect_contains;
using testing::expect_user_error;
using testing::Program;
using testing::read_file;
using testing::Result;
using testing::run;
using testing::Started;
using testing::TemporaryFolder;
using testing::write_file;

/// Contents of all files below a folder, by their names.
std::map<std::string, std::string> contents(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_directory()) continue;
    files[entry.path().lexically_relative(folder).string()] = read_file(entry.path().string());
  }
  return files;
}

void expect_same_run(const std::string& a, const std::string& b) {
  auto first = contents(a);
  auto second = contents(b);
  EXPECT_GT(first.size(), 10u);
  EXPECT_EQ(first.erase("timing.json"), 1u);
  EXPECT_EQ(second.erase("timing.json"), 1u);
  for (const auto& [name, bytes] : first) {
    ASSERT_TRUE(second.contains(name)) << name;
    EXPECT_TRUE(bytes == second[name]) << name << " differs";
  }
  EXPECT_EQ(first.size(), second.size());
}

class Output : public Program {
 protected:
  /// A scenario file of a hovering vehicle.
  std::string scenario(double duration, const std::string& more = "") {
    const std::string path = folder_ / fmt::format("s{}.yaml", number_++);
    write_file(
        path,
        fmt::format(
            "map: {}\nduration: {}\nvehicle:\n  start: [12, 10, 4]\n{}", map(), duration, more));
    return path;
  }
  std::string in(const std::string& name) { return folder_ / name; }

 private:
  TemporaryFolder folder_;
  int number_ = 0;
};

TEST_F(Output, ARunIsRepeatedFromItsFolderWhereverItLies) {
  for (const char* name : {"mine", "deep", "deep/er"}) fs::create_directory(in(name));
  const std::string sensor = read_file(data_folder() + "/lidars/vlp32c.yaml");
  write_file(in("mine/my.yaml"), sensor);
  fs::copy(data_folder() + "/lidars/tables", in("mine/tables"));
  const std::string thing = "map forest --size-x 5 --size-y 5 --trees 0 --density 50 -o ";
  ASSERT_EQ(run(thing + in("mine/thing.pcd")).code, 0);
  write_file(in("mine/s.yaml"),
             fmt::format("map: {}\nduration: 0.3\nvehicle:\n  start: [12, 10, 4]\n"
                         "lidars: [{{model: my.yaml}}, {{model: ./my.yaml}}]\n"
                         "obstacles:\n  - {{shape: cloud, file: thing.pcd, motion: loop, "
                         "waypoints: [[0, 0, 60], [1, 0, 60]]}}\n",
                         map()));
  const Result first =
      run(fmt::format("fly {} -o {} --seed 5 --snapshot", in("mine/s.yaml"), in("run")));
  ASSERT_EQ(first.code, 0) << first.err;
  EXPECT_TRUE(fs::exists(in("run/inputs/my.yaml")));
  EXPECT_TRUE(fs::is_symlink(in("run/forest.pfmap")));
  fs::remove_all(in("mine"));  // all that it needs is in its folder
  const Result again =
      run("fly run/scenario.yaml -o deep/er/again", fmt::format("cd {} &&", in(".")));
  ASSERT_EQ(again.code, 0) << again.err;
  expect_same_run(in("run"), in("deep/er/again"));
  const Result third = run(fmt::format("fly {} -o {}", in("deep/er/again/scenario.yaml"), in("3")));
  ASSERT_EQ(third.code, 0) << third.err;
  expect_same_run(in("run"), in("3"));
  // paths are in timing.json and nowhere else
  for (const auto& [name, bytes] : contents(in("run"))) {
    if (name == "forest.pfmap" || name.starts_with("inputs/")) continue;
    EXPECT_EQ(bytes.find(fs::path(map()).parent_path().string()) != std::string::npos,
              name == "timing.json")
        << name;
  }
  const auto summary = nlohmann::json::parse(read_file(in("run/summary.json")));
  EXPECT_EQ(summary["map"], "forest.pfmap");
  EXPECT_EQ(summary["map_bytes"], fs::file_size(map()));
  expect_contains(read_file(in("run/scenario.yaml")),
                  fmt::format("map_hash: {}", summary["map_hash"].get<std::string>()));
  expect_contains(read_file(in("run/timing.json")), "--seed 5 --snapshot");
}

TEST_F(Output, ARunsMapIsFoundOrGivenAndIsTheSame) {
  fs::create_directory(in("maps"));
  fs::copy_file(map(), in("maps/m.pfmap"));
  ASSERT_EQ(run(fmt::format("fly {} -o {}  --duration 0.2", in("maps/m.pfmap"), in("run"))).code,
            0);
  fs::remove(in("run/overview.png"));
  const Result drawn = run(fmt::format("picture {}", in("run")));
  EXPECT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_FALSE(read_file(in("run/overview.png")).empty());
  fs::rename(in("maps/m.pfmap"), in("maps/moved.pfmap"));
  expect_user_error(run(fmt::format("picture {}", in("run"))), "cannot open");
  expect_user_error(run(fmt::format("fly {} -o {}", in("run/scenario.yaml"), in("no"))),
                    "scenario.yaml:2: map: ");
  EXPECT_EQ(run(fmt::format("picture {} --map {}", in("run"), in("maps/moved.pfmap"))).code, 0);
  EXPECT_EQ(run(fmt::format("fly {} -o {} --map {}",
                            in("run/scenario.yaml"),
                            in("again"),
                            in("maps/moved.pfmap")))
                .code,
            0);
  ASSERT_EQ(
      run(fmt::format("map import {} -o {} --resolution 0.2", cloud(), in("other.pfmap"))).code, 0);
  for (const std::string& command :
       {fmt::format("picture {} --map {}", in("run"), in("other.pfmap")),
        fmt::format(
            "fly {} -o {} --map {}", in("run/scenario.yaml"), in("no"), in("other.pfmap"))}) {
    expect_user_error(run(command), "is another map than this scenario was flown in");
  }
}

TEST_F(Output, ForceTakesAwayTheEarlierRunAndNothingElse) {
  const std::string flight = scenario(0.5);
  ASSERT_EQ(run(fmt::format("fly {} -o {}", flight, in("run"))).code, 0);
  const auto earlier = contents(in("run"));
  EXPECT_TRUE(earlier.contains("scans/0_000004.pcd"));
  write_file(in("run/scans/mine.txt"), "data");
  write_file(in("run/scans/0_000099.pcd"), "looks like a scan and is not the run's");
  // whatever is wrong with the second run, the first one stays as it is
  for (const std::string& wrong : {fmt::format("--record {}", in("nowhere/a.mcap")),
                                   fmt::format("--record {}", in("run/scans/mine.txt")),
                                   std::string("--ros1 --profile nosuch")}) {
    EXPECT_EQ(run(fmt::format("fly {} -o {} --force {}", flight, in("run"), wrong)).code, 2);
    for (const auto& [name, bytes] : earlier) EXPECT_TRUE(read_file(in("run/" + name)) == bytes);
  }
  EXPECT_FALSE(fs::exists(in("run/.partial")));
  const Result again =
      run(fmt::format("fly {} -o {} --force", scenario(0.2, "lidars: []\n"), in("run")));
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_FALSE(fs::exists(in("run/scans/0_000004.pcd")));
  EXPECT_EQ(read_file(in("run/scans/mine.txt")), "data");
  EXPECT_FALSE(read_file(in("run/scans/0_000099.pcd")).empty());
  // nothing outside of the folder, whatever its list of files says
  write_file(in("precious"), "data");
  write_file(in("run/files.txt"),
             read_file(in("run/files.txt")) + "../precious\n/etc/hostname\n..\n.\n");
  EXPECT_EQ(run(fmt::format("fly {} -o {} --force", scenario(0.2), in("run"))).code, 0);
  EXPECT_EQ(read_file(in("precious")), "data");
}

TEST_F(Output, TwoRunsDoNotWriteIntoOneFolderOrRecording) {
  const std::string flight = scenario(100);
  const Started first(
      fmt::format("fly {} -o {} --record {} --rate 1", flight, in("run"), in("a.mcap")));
  ASSERT_TRUE(first.waits_for(in("a.mcap.active")));
  const std::string quick = scenario(0.2);
  expect_user_error(run(fmt::format("fly {} -o {} --force", quick, in("run"))),
                    "another run is being written there");
  expect_user_error(run(fmt::format("fly {} --record {} --force", quick, in("a.mcap"))),
                    "is being written at this moment");
  EXPECT_EQ(first.end(SIGINT), 130);
  EXPECT_TRUE(fs::exists(in("run/summary.json")));
  const Result info = run(fmt::format("bag info {}", in("a.mcap")));
  expect_contains(info.out, "complete     yes");
  expect_user_error(
      run(fmt::format("fly {0} --record {1}/b.mcap --record {1}/./b.mcap --force", quick, in("."))),
      "is given twice");
}

TEST_F(Output, RecordingsAreNotWrittenOverUnlessForced) {
  const std::string flight = scenario(0.2);
  for (const char* name : {"a.mcap", "b.mcap.active"}) {
    write_file(in(name), "precious");
    const std::string path = in(fs::path(name).stem().extension() == ".mcap" ? "b.mcap" : name);
    expect_user_error(run(fmt::format("fly {} --record {}", flight, path)), "is there already");
    EXPECT_EQ(read_file(in(name)), "precious");
    EXPECT_EQ(run(fmt::format("fly {} --record {} --force", flight, path)).code, 0);
    expect_contains(run(fmt::format("bag info {}", path)).out, "complete     yes");
  }
  fs::create_directory(in("c.mcap"));
  expect_user_error(
      run(fmt::format("fly {} -o {} --record {} --force", flight, in("r"), in("c.mcap"))),
      "is not a regular file");
  EXPECT_FALSE(fs::exists(in("r")));
}

TEST_F(Output, AFullDiskEndsTheRecordingAndNotTheFlight) {
  // files of a megabyte at most: the flight's own are smaller
  const std::string flight = scenario(3, "output: {scans: false}\n");
  for (const char* name : {"a.mcap", "b.bag"}) {
    const Result result = run(fmt::format("fly {} -o {} --compression none --record {}",
                                          flight,
                                          in(std::string("run_") + name),
                                          in(name)),
                              "ulimit -f 2000;");
    if (result.err.find("this build has none") != std::string::npos) continue;  // of ROS 1
    EXPECT_EQ(result.code, 2) << result.err;
    expect_contains(result.err, "warning: the recording ends here");
    EXPECT_FALSE(fs::exists(in(name)));
    const auto summary =
        nlohmann::json::parse(read_file(in(std::string("run_") + name + "/summary.json")));
    EXPECT_EQ(summary["end"], "completed");
    EXPECT_EQ(summary["simulated_time"], 3.0);
  }
}

TEST_F(Output, AFullDiskEndsTheFlightWhoseFilesItHolds) {
  // the trajectory is larger; a thread of its own writes it
  const Result result =
      run(fmt::format("fly {} -o {} --no-picture", scenario(3, ""), in("run")), "ulimit -f 100;");
  EXPECT_EQ(result.code, 2) << result.err;
  expect_contains(result.err, "cannot write");
  EXPECT_FALSE(fs::exists(in("run")));
}

TEST_F(Output, AMapThatIsCutShortWhileItIsFlownInIsSaid) {
  fs::copy_file(map(), in("m.pfmap"));
  // far from anything: the tail of the map is not in use yet
  write_file(in("s.yaml"),
             fmt::format("map: m.pfmap\nduration: 100\nvehicle:\n  start: [12, 10, 4]\n"));
  const Started flight(
      fmt::format("fly {} -o {} --rate 1 --record {}", in("s.yaml"), in("run"), in("a.mcap")));
  ASSERT_TRUE(flight.waits_for(in("a.mcap.active")));
  fs::resize_file(in("m.pfmap"), 8192);
  EXPECT_EQ(flight.end(0), 2);
  expect_contains(flight.err(), "m.pfmap: was cut short by another program while it was read");
  EXPECT_FALSE(fs::exists(in("run")));
}

TEST_F(Output, AClosedTerminalEndsAsAnInterrupt) {
  const std::string flight = scenario(100);
  const Started started(
      fmt::format("fly {} -o {} --rate 1 --record {}", flight, in("run"), in("a.mcap")));
  ASSERT_TRUE(started.waits_for(in("a.mcap.active")));
  EXPECT_EQ(started.end(SIGHUP), 130);
  EXPECT_EQ(nlohmann::json::parse(read_file(in("run/summary.json")))["end"], "interrupted");
}

TEST_F(Output, AMeshThatTakesTooMuchMemoryIsNotCalledDamaged) {
  if (testing::kSanitized) return;  // the sanitizer takes far more
  // 180,000 triangles as STL: read by the library of importers, in a process of its own
  constexpr std::uint32_t kTriangles = 180'000;
  std::string stl(80, ' ');
  stl.append(reinterpret_cast<const char*>(&kTriangles), sizeof kTriangles);
  for (std::uint32_t i = 0; i < kTriangles; ++i) {
    const auto x = static_cast<float>(i % 400) * 0.05f;
    const auto y = static_cast<float>(i / 400) * 0.05f;
    const float numbers[12] = {0, 0, 1, x, y, 0, x + 0.05f, y, 0, x, y + 0.05f, 0};
    stl.append(reinterpret_cast<const char*>(numbers), sizeof numbers);
    stl.append(2, '\0');
  }
  write_file(in("m.stl"), stl);
  const Result result =
      run(fmt::format("map import {} -o {}", in("m.stl"), in("m.pfmap")), "ulimit -d 40000;");
  if (result.err.find("libassimp-dev") != std::string::npos) return;  // built without it
  expect_user_error(result, "this mesh takes more memory than there is for it");
}

TEST_F(Output, SmallStacksAndFewOpenFilesAreEnough) {
  const std::string flight = scenario(0.2);
  EXPECT_EQ(run(fmt::format("fly {} -o {}", flight, in("run")), "ulimit -s 256;").code, 0);
  if (!testing::kSanitized) {  // the sanitizer's frames are many times as large
    EXPECT_EQ(
        run(fmt::format("map import {} -o {}", cloud(), in("c.pfmap")), "ulimit -s 256;").code, 0);
  }
  EXPECT_EQ(
      run(fmt::format("scan {} --lidar os1_128 --pose 12,10,2,0,0,0", map()), "ulimit -s 256;")
          .code,
      0);
  write_file(in("swarm.yaml"),
             fmt::format("map: {}\nduration: 0.1\nvehicles:\n  - {{name: a, start: [2, 2, 30], "
                         "copies: 60, copy_offset: [0.7, 0, 0], lidars: []}}\n",
                         map()));
  const Result many =
      run(fmt::format("fly {} -o {}", in("swarm.yaml"), in("swarm")), "ulimit -Sn 128;");
  EXPECT_EQ(many.code, 0) << many.err;
  if (testing::kSanitized) return;  // the sanitizer needs files of its own
  expect_user_error(run(fmt::format("fly {} -o {}", in("swarm.yaml"), in("no")), "ulimit -n 128;"),
                    "Too many open files; allow more (ulimit -n)");
  EXPECT_FALSE(fs::exists(in("no")));
}

TEST_F(Output, EveryCommandRefusesToWriteOverFilesUnlessForced) {
  write_file(in("precious"), "data");
  const std::string old = in("precious");
  const std::vector<std::string> commands = {
      fmt::format("map forest --size-x 6 --size-y 6 -o {}", old),
      fmt::format("map import {} -o {} --resolution 0.5", cloud(), old),
      fmt::format(
          "map import {} -o {} --resolution 0.5 --export-outliers {}", cloud(), in("m"), old),
      fmt::format("map info {} --png {}", map(), old),
      fmt::format("scan {} --pose 12,10,2,0,0,0 -o {}", map(), old),
      fmt::format("scan {} --pose 12,10,2,0,0,0 --png {}", map(), old),
      fmt::format("scenario new {} -o {} --length 5", map(), old),
      fmt::format("vehicle show quad_330 --png {}", old),
  };
  for (const std::string& command : commands) {
    expect_user_error(run(command), "is there already; give another name or --force");
    EXPECT_EQ(read_file(old), "data") << command;
    const Result forced = run(command + " --force");
    EXPECT_EQ(forced.code, 0) << command << forced.err;
    EXPECT_NE(read_file(old), "data") << command;
    write_file(old, "data");
  }
  expect_user_error(
      run(fmt::format("scan {0} --pose 12,10,2,0,0,0 -o {1} --png {1}", map(), in("x"))),
      "another name");
}

TEST_F(Output, ScenariosThatCannotBeAreRefusedOrWarnedOf) {
  const auto check = [&](const std::string& start, const std::string& more = "") {
    write_file(
        in("s.yaml"),
        fmt::format("map: {}\nduration: 0.1\nvehicle:\n  start: {}\n{}", map(), start, more));
    return run(fmt::format("scenario check {}", in("s.yaml")));
  };
  const Result far = check("[940, 10, 3]");
  expect_user_error(far, "s.yaml:4: vehicle.start: (940.00, 10.00, 3.00) of drone0 is outside");
  expect_contains(far.err, "the nearest free position found is (");
  for (const auto& [start, more, words] :
       {std::tuple{"[12, 10, -6]", "", "is below the floor"},
        std::tuple{"[12, 10, 300]", "  landed: true\n", "starts landed, but the ground is 29"}}) {
    const Result result = check(start, more);
    EXPECT_EQ(result.code, 0);
    expect_contains(result.err, words);
    expect_contains(result.err, "the nearest free position found is (");
  }
  EXPECT_EQ(check("[12, 10, 4]").err, "");
  // beside the map there is nothing to fall on
  const std::string falls = scenario(60, "lidars: []\ncommands: [{kind: disarm, time: 0.5}]\n");
  std::string text = read_file(falls);
  text.replace(text.find("[12, 10, 4]"), 11, "[-9, -9, 4]");
  write_file(falls, text);
  const Result fallen = run(fmt::format("fly {} -o {}", falls, in("fallen")));
  EXPECT_EQ(fallen.code, 1);
  const auto summary = nlohmann::json::parse(read_file(in("fallen/summary.json")));
  EXPECT_EQ(summary["end"], "left the map");
  EXPECT_LT(summary["simulated_time"], 10.0);
}

TEST_F(Output, OfSeveralFilesAllAppearOrNone) {
  fs::create_directory(in("s.png.partial"));  // nothing can be drawn there
  const Result scan = run(fmt::format("scan {} --lidar os1_32 --pose 12,10,2,0,0,0 -o {} --png {}",
                                      map(),
                                      in("s.pcd"),
                                      in("s.png")));
  EXPECT_EQ(scan.code, 2);
  EXPECT_FALSE(fs::exists(in("s.pcd")));
  EXPECT_FALSE(fs::exists(in("s.pcd.partial")));
  fs::create_directory(in("c.png.partial"));
  const Result crop = run(
      fmt::format("map crop {} -o {} --max-height 3 --png {}", map(), in("c.pfmap"), in("c.png")));
  EXPECT_EQ(crop.code, 2);
  EXPECT_FALSE(fs::exists(in("c.pfmap")));
}

TEST_F(Output, OfASharedRunItsOwnVehiclesAreShown) {
  write_file(
      in("two.yaml"),
      fmt::format("map: {}\nduration: 1\nvehicles:\n  - {{name: a, start: [12, 10, 4]}}\n"
                  "  - {{name: b, start: [12, 13, 4]}}\nobstacles: [{{count: 1, radius: 0.1}}]\n",
                  map()));
  ASSERT_EQ(run(fmt::format("fly {} -o {}", in("two.yaml"), in("run"))).code, 0);
  // as the process leaves it that flew b alone
  fs::remove_all(in("run/a"));
  auto summary = nlohmann::json::parse(read_file(in("run/summary.json")));
  summary["others"] = nlohmann::json::array();  // braces alone mean other things to other compilers
  summary["others"].push_back(summary["vehicles"][0]);
  summary["vehicles"].erase(0);
  write_file(in("run/summary.json"), summary.dump());
  const Result frames = run(fmt::format("picture {} --frames {} --fps 2", in("run"), in("frames")));
  EXPECT_EQ(frames.code, 0) << frames.err;
  EXPECT_TRUE(fs::exists(in("frames/000000.png")));
  const Result overview = run(fmt::format("picture {} -o {}", in("run"), in("o.png")));
  EXPECT_EQ(overview.code, 0) << overview.err;
  const Result stranger =
      run(fmt::format("picture {} --frames {} --follow 0", in("run"), in("new/none")));
  expect_user_error(stranger, "--follow 0: the folder has vehicle 1");
  EXPECT_FALSE(fs::exists(in("new"))) << "what is refused leaves nothing";
  // numbers that nobody wrote
  write_file(in("run/obstacles.csv"),
             read_file(in("run/obstacles.csv")) + "0.9,10001,1e300,0,0,1,0,0,0,0.1,0.1,0.1\n");
  expect_user_error(run(fmt::format("picture {} -o {}", in("run"), in("p.png"))),
                    "'1e300' is no number of a run");
  summary["vehicles"][0]["scans"] = 1e300;
  write_file(in("run/summary.json"), summary.dump());
  expect_user_error(run(fmt::format("picture {} -o {}", in("run"), in("p.png"))),
                    "summary.json: scans: 1e+300 is no figure of a run");
}

TEST_F(Output, TooLittleOfTheMachineIsSaid) {
  if (testing::kSanitized) return;  // the sanitizer takes far more
  expect_user_error(run(fmt::format("map info {}", map()), "ulimit -s 128;"),
                    "the stack is limited to 128 KB; allow 8 MB, as is usual: ulimit -s 8192");
  for (const int kilobytes : {4000, 8000, 12000, 16000}) {
    expect_user_error(run(fmt::format("map info {} --png {}", map(), in("m.png")),
                          fmt::format("ulimit -d {};", kilobytes)),
                      "out of memory");
    EXPECT_FALSE(fs::exists(in("m.png")));
  }
}

}  // namespace
}  // namespace pointflight
