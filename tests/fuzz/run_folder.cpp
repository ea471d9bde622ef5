// Any bytes as one of the files of a run's folder: played, filmed and drawn, or an InputError of
// one line. The first line of the input names the file; with a ! before it, the folder is of a
// process that has flown one of two vehicles.
#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>

#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/io/cloud_reader.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/picture/run_folder_picture.hpp"
#include "pointflight/run/playback.hpp"
#include "pointflight/run/run_loop.hpp"
#include "tests/fuzz/one_line.hpp"
#include "tests/fuzz/temporary_folder.hpp"
#include "tests/run/recorder.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

/// Of a run with one vehicle; those of a vehicle lie in its folder if there are two.
constexpr std::array<const char*, 9> kFiles = {"trajectory.csv",
                                               "odometry.csv",
                                               "imu.csv",
                                               "range_finder.csv",
                                               "scans.csv",
                                               "events.csv",
                                               "obstacles.csv",
                                               "summary.json",
                                               "scans/0_000000.pcd"};
constexpr std::size_t kFirstOfAll = 5;  // up to the summary: of all vehicles
constexpr std::size_t kLastOfAll = 7;

void write(const fs::path& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

/// A short flight, one file of which is another in each input.
class FolderOnDisk {
 public:
  FolderOnDisk() {
    ShapeScene scene;
    scene.add_box({0, 0, 0}, {10, 8, 5});
    const std::string cloud = (path_ / "c.xyz").string();
    std::ofstream points(cloud);
    scene.sample(100.0, 0.0, 1, [&](const Vector3d& p) { points << p.transpose() << '\n'; });
    points.close();
    ImportOptions options;
    options.resolution = 0.4;
    const Executor executor(1);
    const ImportedMap map = build_map(
        {cloud}, [&](std::size_t) { return open_cloud(cloud); }, options, executor);
    write_map(OutputFile((path_ / "m.pfmap").string()), map.tree, map.description);
    write(path_ / "nine.yaml",
          "title: nine beams\nrate: 20\nrange_max: 30\npattern: grid\n"
          "grid: {projection: pinhole, columns: 3, rows: 3, fx: 2, fy: 2, cx: 1, cy: 1}\n");
    fly(run(false), "", executor);
    fly(run(true), ", {name: w, start: [4, 6, 2], lidars: []}", executor);
    // what the process leaves that has flown v alone
    fs::remove_all(run(true) / "w");
    const fs::path summary = run(true) / "summary.json";
    std::string text = content(summary);
    text.insert(text.rfind('}'), ", \"others\": [{\"name\": \"w\"}]");
    write(summary, text);
    for (const bool shared : {false, true}) {
      for (std::size_t i = 0; i < kFiles.size(); ++i) {
        const fs::path file = path_of(i, shared);
        originals_[file.string()] = content(file);
        if (originals_[file.string()].empty()) __builtin_trap();
      }
    }
  }

  [[nodiscard]] fs::path run(bool shared) const { return path_ / (shared ? "shared" : "run"); }
  [[nodiscard]] fs::path path_of(std::size_t file, bool shared) const {
    const bool is_of_all = file >= kFirstOfAll && file <= kLastOfAll;
    return (shared && !is_of_all ? run(shared) / "v" : run(shared)) / kFiles[file];
  }
  [[nodiscard]] const std::string& original(const fs::path& file) const {
    return originals_.at(file.string());
  }

 private:
  static std::string content(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  void fly(const fs::path& folder, const std::string& more, const Executor& executor) const {
    write(path_ / "s.yaml",
          "map: m.pfmap\nduration: 0.08\nobstacles: [{count: 2, radius: 0.2}]\n"
          "vehicles: [{name: v, start: [4, 4, 2], lidars: [{model: nine.yaml}],\n"
          "            sensors: [{kind: range_finder, rate: 50}],\n"
          "            mission: {waypoints: [[6, 4, 2]]}}" +
              more + "]\noutput: {odometry: true, trajectory_rate: 20}\n");
    const Scenario scenario = load_scenario((path_ / "s.yaml").string());
    Simulation simulation(scenario, scenario.open_map(), executor);
    RunLoop loop(simulation, {});
    testing::Recorder recorder(folder.string(), simulation);
    loop.add(recorder);
    loop.run();
  }

  FuzzFolder folder_;
  fs::path path_ = folder_.path();
  std::map<std::string, std::string> originals_;
};

}  // namespace
}  // namespace pointflight

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace pointflight;
  static const FolderOnDisk folder;
  static const Executor executor(1);
  // made anew for each input they would take most of the time
  static const std::array simulations = {simulation_of_run(folder.run(false).string(), executor),
                                         simulation_of_run(folder.run(true).string(), executor)};
  std::string_view text(reinterpret_cast<const char*>(data), size);
  const bool shared = text.starts_with('!');
  if (shared) text.remove_prefix(1);
  const std::size_t line = std::min(text.find('\n'), text.size());
  for (std::size_t i = 0; i < kFiles.size(); ++i) {
    if (text.substr(0, line) != kFiles[i]) continue;
    const fs::path file = folder.path_of(i, shared);
    write(file, text.substr(std::min(line + 1, text.size())));
    const std::string run_folder = folder.run(shared).string();
    expect_one_line([&] {
      RecordedRun run(run_folder, simulations[shared ? 1 : 0], executor);
      play(run, {}, {});
    });
    expect_one_line([&] {
      const picture::RunPicture drawn = picture::read_run_picture(run_folder);
      if (drawn.names.size() < drawn.paths.size()) __builtin_trap();
    });
    write(file, folder.original(file));
  }
  return 0;
}
