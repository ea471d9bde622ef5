// Recordings of whole flights: by our reader, and field by field by an independent one.
#include <signal.h>
#include <sys/wait.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>
#include <vector>

#include "pointflight/io/csv_table.hpp"
#include "tests/integration/program.hpp"
#include "tests/paths.hpp"

namespace pointflight {
namespace {

using Json = nlohmann::json;
using testing::expect_contains;
using testing::expect_user_error;
using testing::Program;
using testing::read_file;
using testing::Result;
using testing::run;
using testing::TemporaryFolder;
using testing::write_file;

/// Where `./dev test` puts Foxglove's MCAP reader; "" if it could not.
std::string node_folder() {
  const std::string folder = std::string(testing::kSource) + "/build/node";
  return std::filesystem::exists(folder + "/node_modules/@mcap/core") ? folder : "";
}

#define SKIP_WITHOUT_NODE() \
  if (node_folder().empty()) GTEST_SKIP() << "Foxglove's MCAP reader is not there (npm)"

/// Lines of JSON that the independent reader prints: a head, then each message.
std::vector<Json> read_independently(const std::string& path, const std::string& how = "") {
  const TemporaryFolder folder;
  const std::string command =
      fmt::format("node '{}' '{}' '{}' {} >'{}' 2>'{}'",
                  std::string(testing::kSource) + "/tests/recording/read_mcap.js",
                  node_folder(),
                  path,
                  how,
                  folder / "out",
                  folder / "err");
  const int status = std::system(command.c_str());  // NOLINT(concurrency-mt-unsafe)
  EXPECT_EQ(status, 0) << read_file(folder / "err");
  std::vector<Json> lines;
  std::istringstream out(read_file(folder / "out"));
  for (std::string line; std::getline(out, line);) lines.push_back(Json::parse(line));
  return lines;
}

/// A flight of two metres with a Mid-360; two seconds and more.
std::string scenario_in(const std::string& folder, const std::string& map, const char* more = "") {
  const std::string path = folder + "/s.yaml";
  const Result made = run(fmt::format("scenario new {} -o {} --length 5", map, path));
  EXPECT_EQ(made.code, 0) << made.err;
  write_file(path, read_file(path) + more);
  return path;
}

/// The folder's seen.pfmap knows what was seen: its marks reach files and messages.
void expect_marks_on_ros_and_in_the_folder(const TemporaryFolder& folder) {
  const auto in = [&](const char* name) { return folder / name; };
  const std::string ros =
      "duration: 0.3\nros:\n  outputs:\n    - {kind: cloud, topic: /p, layout: xyzit_unknown}\n";
  const std::string head = "map: seen.pfmap\nvehicle: {start: [2, 5, 2]}\nlidars:\n";
  write_file(in("marks.yaml"), head + "  - {model: mid360, mark_unknown: true}\n" + ros);
  write_file(in("plain.yaml"), head + "  - {model: mid360}\n" + ros);
  expect_user_error(
      run(fmt::format("fly {} -o {} --record {}", in("plain.yaml"), in("x"), in("x.mcap"))),
      "mark_unknown: true");
  const Result fly =
      run(fmt::format("fly {} -o {} --record {}", in("marks.yaml"), in("b"), in("b.mcap")));
  ASSERT_EQ(fly.code, 0) << fly.err;
  expect_contains(read_file(in("b/scans/0_000000.pcd")), "label unknown\n");
}

TEST_F(Program, MakesAMapOfARecordingAndSaysWhatItSaw) {
  const TemporaryFolder folder;
  const auto in = [&](const char* name) { return folder / name; };
  const std::string yaml = scenario_in(folder.path(), map());
  std::vector<std::string> recordings = {in("run.mcap")};
#ifdef POINTFLIGHT_WITH_ROS1
  recordings.push_back(in("run.bag"));
#endif
  std::string flight = fmt::format("fly {} -o {} --duration 0.8", yaml, in("run"));
  for (const std::string& recording : recordings) flight += " --record " + recording;
  const Result fly = run(flight);
  ASSERT_EQ(fly.code, 0) << "its mission is cut short, as was asked for: " << fly.err;
  expect_user_error(run(fmt::format("map import --scans {} -o {}", in("run.mcap"), in("x.pfmap"))),
                    "choose one by --scan-topic");
  expect_user_error(run(fmt::format("map import --scans {0} --scan-topic /drone0/mid360/points "
                                    "--resolution 0.1 -o {0} --force",
                                    in("run.mcap"))),
                    "run.mcap");
  for (const std::string& recording : recordings) {
    const Result made =
        run(fmt::format("map import --scans {} --scan-topic /drone0/mid360/points "
                        "--resolution 0.1 -o {} --force",
                        recording,
                        in("seen.pfmap")));
    ASSERT_EQ(made.code, 0) << made.err;
    expect_contains(made.err, "poses of /drone0/odom (drone0/base_link in world)");
    // what it shows stands in the map that was flown through
    const Result diff = run(fmt::format("map diff {} {} --json", in("seen.pfmap"), map()));
    const Json only = Json::parse(diff.out)["only_in_first"];
    EXPECT_GT(only["surfels"].get<int>(), 5000);
    EXPECT_LT(only["share"].get<double>(), 0.002) << diff.out;
    // and its rays lead to that map
    const Result compared = run(fmt::format(
        "compare {} --scans {} --scan-topic /drone0/mid360/points --json", map(), recording));
    ASSERT_EQ(compared.code, 0) << compared.err;
    const Json rays = Json::parse(compared.out)["overall"]["all"];
    EXPECT_GT(rays["rays"].get<int>(), 40000);
    EXPECT_LT(rays["median_abs_error"].get<double>(), 0.03);
    EXPECT_LT(rays["wrong_fraction"].get<double>(), 0.07) << "points between two things, too";
  }
  const Json info = Json::parse(
      run(fmt::format("map info {} --json --at 2,5,-3 --at 0,0,99", in("seen.pfmap"))).out);
  EXPECT_GT(info["known_space"]["share"].get<double>(), 0.1);
  EXPECT_FALSE(info["at"][0]["known"].get<bool>()) << "below the ground";
  // a point for each return, marked or not
  const std::string scan = "--pose 5,5,2,0,0,0 -o " + in("scan.pcd");
  const Result marked = run(fmt::format("scan {} {} --mark-unknown", in("seen.pfmap"), scan));
  ASSERT_EQ(marked.code, 0) << marked.err;
  expect_contains(marked.out, "came through space that no survey saw");
  expect_contains(read_file(in("scan.pcd")), "label unknown\n");
  expect_user_error(run(fmt::format("scan {} {} --mark-unknown --force", map(), scan)),
                    "map import --scans");
  expect_marks_on_ros_and_in_the_folder(folder);
}

TEST_F(Program, RecordsAFlightAndSaysWhatIsInIt) {
  const TemporaryFolder folder;
  const std::string yaml = scenario_in(folder.path(), map());
  const std::string bag = folder / "run.mcap";
  const Result fly =
      run(fmt::format("fly {} -o {} --record {} --compression lz4", yaml, folder / "run", bag));
  ASSERT_EQ(fly.code, 0) << fly.err;
  expect_contains(fly.err, "recorded " + bag);
  const Result info = run(fmt::format("bag info {}", bag));
  ASSERT_EQ(info.code, 0) << info.err;
  expect_contains(info.out, "complete     yes");
  expect_contains(info.out, "(lz4)");
  expect_contains(info.out, "scenario.yaml");
  expect_contains(info.out, "/drone0/mid360/points  sensor_msgs/msg/PointCloud2");
  // the same bytes for the same seed
  const std::string again = folder / "again.mcap";
  ASSERT_EQ(run(fmt::format("fly {} -o {} --record {} --compression lz4 --threads 1",
                            yaml,
                            folder / "run2",
                            again))
                .code,
            0);
  EXPECT_TRUE(read_file(bag) == read_file(again));
}

TEST_F(Program, Slow_AnIndependentReaderFindsTheSameInARecording) {
  SKIP_WITHOUT_NODE();
  const TemporaryFolder folder;
  const std::string yaml = scenario_in(folder.path(), map());
  const std::string bag = folder / "run.mcap";
  ASSERT_EQ(run(fmt::format("fly {} -o {} --record {}", yaml, folder / "run", bag)).code, 0);
  const auto lines = read_independently(bag);
  ASSERT_GT(lines.size(), 1000u);
  EXPECT_EQ(lines[0]["profile"], "ros2");
  EXPECT_EQ(lines[0]["attachments"][0], "scenario.yaml");
  std::map<std::string, std::vector<Json>> topics;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    topics[lines[i]["topic"]].push_back(lines[i]["message"]);
  }
  const auto seconds = [](const Json& message) {
    const Json& stamp = message["header"]["stamp"];
    return stamp["sec"].get<double>() - 1.7e9 + 1e-9 * stamp["nanosec"].get<double>();
  };
  // the IMU's numbers are those of its file
  const CsvTable imu(folder / "run/imu.csv");
  ASSERT_EQ(topics["/drone0/imu"].size(), imu.rows());
  for (std::size_t i = 0; i < imu.rows(); i += 13) {
    const Json& m = topics["/drone0/imu"][i];
    EXPECT_NEAR(seconds(m), imu.at(i, imu.require("time")), 1e-6);
    EXPECT_EQ(m["angular_velocity"]["y"].get<double>(), imu.at(i, imu.require("gyro_y")));
    EXPECT_EQ(m["linear_acceleration"]["z"].get<double>(), imu.at(i, imu.require("accel_z")));
  }
  // the odometry's are the truth's, velocities turned into the body
  const CsvTable truth(folder / "run/trajectory.csv");
  ASSERT_EQ(topics["/drone0/odom"].size(), truth.rows());
  for (std::size_t i = 0; i < truth.rows(); i += 13) {
    const auto at = [&](const char* name) { return truth.at(i, truth.require(name)); };
    const Json& m = topics["/drone0/odom"][i];
    const Json& pose = m["pose"]["pose"];
    EXPECT_EQ(pose["position"]["x"].get<double>(), at("px"));
    EXPECT_EQ(pose["orientation"]["w"].get<double>(), at("qw"));
    const Quaterniond q(at("qw"), at("qx"), at("qy"), at("qz"));
    const Vector3d v = q.conjugate() * Vector3d(at("vx"), at("vy"), at("vz"));
    EXPECT_NEAR(m["twist"]["twist"]["linear"]["x"].get<double>(), v.x(), 1e-12);
    EXPECT_EQ(m["twist"]["twist"]["angular"]["z"].get<double>(), at("wz"));
    EXPECT_EQ(m["child_frame_id"], "drone0/base_link");
  }
  // clouds have as many points as their files say, and lie where the layout says
  std::vector<std::size_t> points;
  std::ifstream scans(folder / "run/scans.csv");
  std::string line;
  std::getline(scans, line);
  while (std::getline(scans, line)) {
    std::istringstream cells(line);
    std::string cell;
    for (int i = 0; i < 7; ++i) std::getline(cells, cell, ',');
    points.push_back(std::stoul(cell));
  }
  const auto& clouds = topics["/drone0/mid360/points"];
  ASSERT_EQ(clouds.size(), points.size());
  for (std::size_t i = 0; i < clouds.size(); ++i) {
    EXPECT_EQ(clouds[i]["width"].get<std::size_t>(), points[i]);
    EXPECT_EQ(clouds[i]["data"]["length"].get<std::size_t>(), 26 * points[i]);
    EXPECT_EQ(clouds[i]["fields"][6]["name"], "timestamp");
  }
  EXPECT_EQ(topics["/tf_static"].size(), 1u);
  EXPECT_EQ(topics["/tf_static"][0]["transforms"][0]["child_frame_id"], "drone0/mid360");
}

TEST_F(Program, ARecordingOfAKilledFlightIsReadable) {
  const TemporaryFolder folder;
  const std::string yaml = scenario_in(folder.path(), map());
  const std::string bag = folder / "run.mcap";
  const std::string output = folder / "run";
  const std::string active = bag + ".active";
  const pid_t child = fork();
  if (child == 0) {
    const char* arguments[] = {testing::kProgram,
                               "fly",
                               yaml.c_str(),
                               "-o",
                               output.c_str(),
                               "--rate",
                               "1.0",
                               "--record",
                               bag.c_str(),
                               nullptr};
    execv(testing::kProgram, const_cast<char* const*>(arguments));
    _exit(127);
  }
  // the map's chunk, and after it others of what is measured
  std::uintmax_t size = 0;
  std::uintmax_t wanted = 1000000;
  for (int grown = 0; grown < 2; ++grown, wanted = size + 300000) {
    for (int i = 0; i < 6000 && size <= wanted; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      std::error_code error;
      const std::uintmax_t now = std::filesystem::file_size(active, error);
      if (!error) size = now;
    }
  }
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_FALSE(std::filesystem::exists(bag));
  const Result info = run(fmt::format("bag info {}", active));
  ASSERT_EQ(info.code, 0) << info.err;
  expect_contains(info.out, "complete     no");
  expect_contains(info.out, "/drone0/imu");
  if (node_folder().empty()) return;
  EXPECT_GT(read_independently(active, "cut").size(), 100u);
}

TEST_F(Program, NamesOfAScenarioComeBeforeTheProfiles) {
  const TemporaryFolder folder;
  const std::string yaml = scenario_in(folder.path(), map());
  // the written file has a `ros` section already: another one instead
  const std::string text = read_file(yaml);
  const auto with = [&](const std::string& ros) {
    write_file(yaml, text.substr(0, text.find("\nros:")) + "\n" + ros);
    return run(
        fmt::format("fly {} -o {} --force --record {}", yaml, folder / "run", folder / "run.mcap"));
  };
  const Result good = with(
      "ros:\n  profile: livox\n  outputs:\n"
      "    - {kind: cloud, topic: /points, layout: velodyne, frame: velo}\n"
      "    - {kind: map, topic: '-'}\n");
  ASSERT_EQ(good.code, 0) << good.err;
  const Result info = run(fmt::format("bag info {}", folder / "run.mcap"));
  expect_contains(info.out, "/points  sensor_msgs/msg/PointCloud2");
  expect_contains(info.out, "/livox/imu");
  EXPECT_EQ(info.out.find("/livox/lidar"), std::string::npos);
  EXPECT_EQ(info.out.find("/ground_truth/map"), std::string::npos);
  expect_user_error(with("ros:\n  profile: livx\n"), "livox");
  expect_user_error(with("ros:\n  outputs:\n    - {kind: clowd}\n"), "did you mean 'cloud'?");
  expect_user_error(with("ros:\n  outputs:\n    - {kind: cloud, layout: velodine}\n"),
                    "did you mean 'velodyne'?");
  expect_user_error(with("ros:\n  epoch: tomorrow\n"), "'now' or seconds since 1970");
}

TEST_F(Program, WrongRecordingsAreSaid) {
  const TemporaryFolder folder;
  const std::string yaml = scenario_in(folder.path(), map());
  const auto fly = [&](const std::string& more) {
    return run(fmt::format("fly {} -o {} --force {}", yaml, folder / "run", more));
  };
  expect_user_error(fly(fmt::format("--record {}", folder / "run.txt")), "ends in .mcap");
  expect_user_error(fly(fmt::format("--record {}", folder / "nowhere/run.mcap")), "No such file");
  expect_user_error(fly(fmt::format("--record {0} --record {0}", folder / "a.mcap")), "twice");
  expect_user_error(run(fmt::format("bag info {}", yaml)),
                    "a recording (.mcap, .bag, .db3) is wanted here, and this is a YAML file");
  expect_user_error(run(fmt::format("bag info {}", folder / "none.mcap")), "none.mcap");
}

}  // namespace
}  // namespace pointflight
