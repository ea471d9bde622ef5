// Any bytes as one of the files of a run's folder: played, or an InputError of one line. The first
// line of the input names the file.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>

#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/io/cloud_reader.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/run/playback.hpp"
#include "pointflight/run/run_loop.hpp"
#include "tests/run/recorder.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 7> kFiles = {"trajectory.csv",
                                               "odometry.csv",
                                               "imu.csv",
                                               "events.csv",
                                               "obstacles.csv",
                                               "summary.json",
                                               "scans/0_000000.pcd"};

void write(const fs::path& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

/// A short flight, one file of which is another in each input.
class FolderOnDisk {
 public:
  FolderOnDisk() {
    std::string name = (fs::temp_directory_path() / "pointflight_fuzz_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) __builtin_trap();
    path_ = name;
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
    write(path_ / "s.yaml",
          "map: m.pfmap\nduration: 0.08\nobstacles: [{count: 2, radius: 0.2}]\n"
          "vehicles: [{name: v, start: [4, 4, 2], lidars: [{model: nine.yaml}],\n"
          "            mission: {waypoints: [[6, 4, 2]]}}]\n"
          "output: {odometry: true, trajectory_rate: 20}\n");
    const Scenario scenario = load_scenario((path_ / "s.yaml").string());
    Simulation simulation(scenario, scenario.open_map(), executor);
    RunLoop loop(simulation, {});
    testing::Recorder recorder((path_ / "run").string(), simulation);
    loop.add(recorder);
    loop.run();
    for (const char* file : kFiles) {
      std::ifstream in(run() / file, std::ios::binary);
      originals_[file].assign(std::istreambuf_iterator<char>(in), {});
    }
  }
  ~FolderOnDisk() { fs::remove_all(path_); }

  [[nodiscard]] fs::path run() const { return path_ / "run"; }
  [[nodiscard]] const std::string& original(const std::string& file) const {
    return originals_.at(file);
  }

 private:
  fs::path path_;
  std::map<std::string, std::string> originals_;
};

}  // namespace
}  // namespace pointflight

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace pointflight;
  static const FolderOnDisk folder;
  static const Executor executor(1);
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t line = std::min(text.find('\n'), text.size());
  for (const char* file : kFiles) {
    if (text.substr(0, line) != file) continue;
    write(folder.run() / file, text.substr(std::min(line + 1, text.size())));
    try {
      RecordedRun run(folder.run().string(), executor);
      play(run, {}, {});
    } catch (const InputError& error) {
      if (std::string(error.what()).find('\n') != std::string::npos) __builtin_trap();
    }
    write(folder.run() / file, folder.original(file));
  }
  return 0;
}
