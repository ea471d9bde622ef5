// A run's folder, played through the link that published it: the same messages.
#include "pointflight/run/playback.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <map>
#include <set>

#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/ros/common/ros_link.hpp"
#include "pointflight/run/run_loop.hpp"
#include "pointflight/run/threaded_link.hpp"
#include "tests/run/recorder.hpp"
#include "tests/sim/runs.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::read_file;
using testing::Recorder;
using testing::TemporaryFolder;
using testing::write_file;

/// A message and when it left.
using Sent = std::pair<std::int64_t, std::vector<std::byte>>;
using Messages = std::map<std::string, std::vector<Sent>>;

/// Keeps all messages by topic.
class Keeper : public Outlet {
 public:
  explicit Keeper(Messages& messages) : messages_(messages) {}
  [[nodiscard]] Wire wire() const override { return Wire::kCdr; }
  int advertise(const Topic& topic) override {
    names_.push_back(topic.name);
    return static_cast<int>(names_.size()) - 1;
  }
  [[nodiscard]] bool has_readers(int /*topic*/) const override { return true; }
  void send(int topic, const Bytes& bytes, std::int64_t time) override {
    messages_[names_[static_cast<std::size_t>(topic)]].emplace_back(time, *bytes);
  }

 private:
  Messages& messages_;
  std::vector<std::string> names_;
};

std::unique_ptr<RosLink> keeping(const RunDescription& run, Messages& messages) {
  auto link = std::make_unique<RosLink>(run, load_ros_profile("default"), RosLinkOptions{});
  link->add_recording(std::make_unique<Keeper>(messages));
  return link;
}

/// Two vehicles among obstacles, one of which touches the floor, with late odometry and lost scans.
void fly(const TemporaryFolder& folder, Messages& messages, double duration = 1.5) {
  ShapeScene scene;
  scene.add_box({0, 0, 0}, {20, 12, 6});
  std::vector<CloudPoint> points;
  scene.sample(400.0, 0.003, 1, [&](const Vector3d& p) { points.push_back({p, 10.0f}); });
  ImportOptions options;
  options.resolution = 0.2;
  const ImportedMap map = testing::import_points(points, options);
  write_map(OutputFile(folder / "m.pfmap"), map.tree, map.description);
  write_file(folder / "s.yaml",
             fmt::format("map: m.pfmap\nduration: {}\n", duration) +
                 "vehicles:\n"
                 "  - name: one\n    start: [4, 6, 3]\n"
                 "    lidars: [{model: os1_32}, {model: d455, snapshot: true}]\n"
                 "    mission: {waypoints: [[10, 6, 3]]}\n"
                 "    faults: [{kind: odometry_delay, value: 0.05, from: 0.5, until: 1},\n"
                 "             {kind: scan_drop, from: 0.3, value: 0.4}]\n"
                 "  - {name: two, start: [12, 8, 0.45], lidars: [{model: mid360}],\n"
                 "     commands: [{time: 0.2, kind: velocity, vector: [0, 0, -0.6]}]}\n"
                 "obstacles: [{count: 5, radius: 0.2}]\noutput: {odometry: true}\n");
  const Executor executor(2);
  const Scenario scenario = load_scenario(folder / "s.yaml");
  Simulation simulation(scenario, scenario.open_map(), executor);
  RunLoop loop(simulation, {});
  Recorder recorder(folder / "run", simulation);
  const auto ros = keeping(describe_run(simulation), messages);
  loop.add(recorder);
  loop.add(*ros);
  loop.run();
}

TEST(Playback, Slow_ARunsFolderGivesTheMessagesOfTheRun) {
  const TemporaryFolder folder;
  Messages flown;
  fly(folder, flown);
  ASSERT_GT(flown["/collisions"].size(), 0u) << "the test wants one";

  const Executor executor(2);
  RecordedRun run(folder / "run", executor);
  EXPECT_EQ(run.end(), SimTime(from_seconds(1.5)));
  Messages played;
  const auto ros = keeping(run.description(), played);
  Link* const links[] = {ros.get()};
  play(run, links, {});

  // statuses and infrared pictures are not in the folder, and the way within a scan is known by 200
  // states per second
  const std::set<std::string> differ = {"/diagnostics"};
  for (const auto& [topic, messages] : flown) {
    if (topic.ends_with("infrared")) continue;
    ASSERT_EQ(played[topic].size(), messages.size()) << topic;
    if (differ.contains(topic) || topic.ends_with("points_world")) continue;
    std::size_t same = 0;
    for (std::size_t i = 0; i < messages.size(); ++i) same += messages[i] == played[topic][i];
    EXPECT_EQ(same, messages.size()) << topic;
  }
  EXPECT_EQ(flown.size(), played.size() + 1);

  // once more, behind a thread of its own
  Messages again;
  const auto second = keeping(run.description(), again);
  ThreadedLink threaded(*second, {.capacity = 8});
  Link* const other[] = {&threaded};
  play(run, other, {});
  EXPECT_EQ(again["/two/mid360/points"], flown["/two/mid360/points"]);
}

/// What is said of a folder whose run cannot be played.
std::string error_of_run(const TemporaryFolder& folder) {
  const Executor executor(1);
  return error_of([&] {
    RecordedRun run(folder / "run", executor);
    play(run, {}, {});
  });
}

TEST(Playback, FoldersThatAreNoRunsSayWhatIsMissing) {
  const TemporaryFolder folder;
  Messages messages;
  fly(folder, messages, 0.4);
  const auto error = [&] { return error_of_run(folder); };
  const std::string states = read_file(folder / "run/one/trajectory.csv");
  write_file(folder / "run/one/trajectory.csv", states.substr(0, states.find('\n') + 1));
  expect_contains(error(), "trajectory.csv: has no states");
  std::string doubled = states;
  doubled += states.substr(states.find('\n') + 1);
  write_file(folder / "run/one/trajectory.csv", doubled);
  expect_contains(error(), "times must ascend");
  write_file(folder / "run/one/trajectory.csv", states);
  const std::string scan = read_file(folder / "run/two/scans/0_000000.pcd");
  write_file(folder / "run/two/scans/0_000000.pcd", scan.substr(0, scan.size() - 3));
  expect_contains(error(), "is no scan of a run");
  std::string other = scan;
  other[other.size() - 28 + 3] ^= 0x40;  // the last x, by a power of two
  write_file(folder / "run/two/scans/0_000000.pcd", other);
  expect_contains(error(), "points are not the sensor's");
  write_file(folder / "run/two/scans/0_000000.pcd", scan);
  write_file(folder / "run/one/imu.csv", "time,gyro_x\n0,0\n");
  expect_contains(error(), "2 columns where a run writes 7");
  write_file(folder / "run/one/imu.csv", "time,gyro_x\n");  // nothing came
  EXPECT_NO_THROW(RecordedRun(folder / "run", Executor(1)));
  const std::string events = read_file(folder / "run/events.csv");
  write_file(folder / "run/events.csv", events + "1.2,collision,map,,,,,,,,\n");
  expect_contains(error(), "the scenario has no vehicle 'map'");
  write_file(folder / "run/events.csv", events);
  const std::string summary = read_file(folder / "run/summary.json");
  std::string endless = summary;
  endless.replace(endless.find("\"simulated_time\": 0.4"), 21, "\"simulated_time\": 1e6");
  write_file(folder / "run/summary.json", endless);
  expect_contains(error(), "the run ended at 1000000.0 s, its files at 0.4 s");
  std::filesystem::remove(folder / "run/summary.json");
  expect_contains(error(), "summary.json: cannot open");
}

/// The folder as a process leaves it that has flown the second vehicle of a shared run alone.
void leave_to_the_other(const TemporaryFolder& folder) {
  std::filesystem::rename(folder / "run/one", folder / "one");
  std::string summary = read_file(folder / "run/summary.json");
  summary.insert(summary.rfind('}'), ", \"others\": [{\"name\": \"one\"}]");
  write_file(folder / "run/summary.json", summary);
}

TEST(Playback, OfASharedRunHasTheVehiclesOfItsFolder) {
  const TemporaryFolder folder;
  Messages flown;
  fly(folder, flown, 0.4);
  leave_to_the_other(folder);
  const Executor executor(2);
  const auto play_all = [&] {
    RecordedRun run(folder / "run", executor);
    Messages played;
    const auto ros = keeping(run.description(), played);
    Link* const links[] = {ros.get()};
    play(run, links, {});
    return played;
  };
  Messages played = play_all();
  std::size_t of_two = 0;
  for (const auto& [topic, messages] : flown) {
    if (topic.find("two") == std::string::npos || topic.ends_with("points_world")) continue;
    EXPECT_EQ(played[topic].size(), messages.size()) << topic;
    of_two += messages.size();
  }
  EXPECT_GT(of_two, 20u);
  EXPECT_TRUE(played["/one/odom"].empty());
  // the folders of both put together
  std::filesystem::rename(folder / "one", folder / "run/one");
  EXPECT_EQ(play_all()["/one/odom"].size(), flown["/one/odom"].size());
}

TEST(Playback, NumbersThatNoRunWritesAreSaidWithTheirLine) {
  const TemporaryFolder folder;
  Messages messages;
  fly(folder, messages, 0.4);
  const auto error = [&] { return error_of_run(folder); };
  const auto with_row = [&](const std::string& file, const std::string& row) {
    const std::string path = folder / ("run/" + file);
    const std::string before = read_file(path);
    write_file(path, before + row + "\n");
    const std::string found = error();
    write_file(path, before);
    return found;
  };
  expect_contains(with_row("obstacles.csv", "0.3,10001,1e300,0,0,1,0,0,0,1,1,1"),
                  "is no position of a run");
  expect_contains(with_row("obstacles.csv", "0.3,1e300,0,0,0,1,0,0,0,1,1,1"), "is no label");
  expect_contains(with_row("obstacles.csv", "0.3,10001,0,0,0,0,0,0,0,1,1,1"), "no unit quaternion");
  expect_contains(with_row("events.csv", "0.3,collision,one,obstacle 1e300,0,0,0,0,0,0,0"),
                  "events.csv:");
  expect_contains(with_row("events.csv", "0.3,collision,one,map,1e300,0,0,0,0,0,0"),
                  "no number of a run");
  expect_contains(with_row("one/scans.csv", "a.pcd,4294967296,0,0,0.1,9,9"),
                  "the scenario has no lidar 4294967296");
  expect_contains(with_row("one/scans.csv", "a.pcd,0,0.5,0,0.1,9,9"), "is no count");
  expect_contains(with_row("one/odometry.csv", "0.3,0.3,nan,0,0,1,0,0,0,0,0,0,0,0,0"),
                  "odometry.csv:");
  expect_contains(with_row("events.csv", "0.3,collision"), "2 columns where a run writes 11");
}

TEST(Playback, PipesInARunsFolderAreRefusedAtOnce) {
  const TemporaryFolder folder;
  Messages messages;
  fly(folder, messages, 0.4);
  for (const char* file : {"events.csv",
                           "obstacles.csv",
                           "summary.json",
                           "scenario.yaml",
                           "one/trajectory.csv",
                           "one/scans.csv",
                           "one/imu.csv"}) {
    const std::string path = folder / (std::string("run/") + file);
    std::filesystem::rename(path, path + ".aside");
    ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
    expect_contains(error_of_run(folder), "a pipe or socket, not a regular file");
    std::filesystem::remove(path);
    std::filesystem::rename(path + ".aside", path);
  }
}

}  // namespace
}  // namespace pointflight
