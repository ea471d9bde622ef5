// What each stage of an import costs, from points that lie in memory: points and cells per second,
// and the most memory that was resident. `./dev bench import`; see BENCHMARK.md.
#include <fmt/format.h>
#include <sys/resource.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "pointflight/core/random.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/scenes/exact_scene.hpp"

namespace pointflight {
namespace {

struct Flags {
  std::vector<std::string> scenes = {"hall", "forest"};
  double resolution = 0.05;
  double noise = 0.0;
  double points_per_cell = 8.0;
  int copies = 1;
  std::vector<int> threads = {1, 2};
  std::string output;  ///< Keeps the last map.
  bool normal = false;
  bool json = false;
};

/// Points of a scene as floats; read `copies` times, each time moved by more than the scene is
/// wide.
struct MemoryCloud {
  std::vector<std::array<float, 3>> points;
  Vector3d size = Vector3d::Zero();
};

class MemoryReader : public CloudReader {
 public:
  MemoryReader(const MemoryCloud& cloud, int copies) : cloud_(cloud), copies_(copies) {}

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    if (copy_ == copies_) return false;
    const std::size_t n = std::min(kBatch, cloud_.points.size() - at_);
    batch.resize(n);
    constexpr int kInARow = 8;
    const int row = copy_ / kInARow;
    const Vector3d shift = cloud_.size.cwiseProduct(Vector3d(copy_ - row * kInARow, row, 0));
    for (std::size_t i = 0; i < n; ++i) {
      const auto& p = cloud_.points[at_ + i];
      batch[i].position =
          Vector3d(
              static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])) +
          shift;
    }
    at_ += n;
    if (at_ == cloud_.points.size()) {
      at_ = 0;
      ++copy_;
    }
    return true;
  }
  [[nodiscard]] bool has_intensity() const override { return false; }
  [[nodiscard]] double share_read() const override { return static_cast<double>(copy_) / copies_; }

 private:
  const MemoryCloud& cloud_;
  int copies_;
  int copy_ = 0;
  std::size_t at_ = 0;
};

MemoryCloud cloud_of(const ExactScene& scene, const Flags& flags) {
  SceneSampling sampling;
  sampling.resolution = flags.resolution;
  sampling.noise = flags.noise;
  sampling.points_per_cell = flags.points_per_cell;
  const auto reader = sampled_cloud(scene, sampling);
  MemoryCloud cloud;
  Aabb bounds;
  std::vector<CloudPoint> batch;
  while (reader->read(batch)) {
    for (const CloudPoint& p : batch) {
      cloud.points.push_back({static_cast<float>(p.position.x()),
                              static_cast<float>(p.position.y()),
                              static_cast<float>(p.position.z())});
      bounds.add(p.position);
    }
  }
  cloud.size = bounds.max - bounds.min + Vector3d(1.0, 1.0, 1.0);
  return cloud;
}

double resident_peak_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024e-6;
}

struct Stage {
  std::string what;
  double seconds = 0.0;
  double peak_mb = 0.0;  ///< Of the process up to its end.
};

/// The stages in the order in which they began.
std::vector<Stage> timed_import(const MemoryCloud& cloud,
                                const std::string& name,
                                const Flags& flags,
                                int threads,
                                ImportReport& report) {
  using Clock = std::chrono::steady_clock;
  std::vector<Stage> stages;
  Clock::time_point began = Clock::now();
  const auto close = [&] {
    const Clock::time_point now = Clock::now();
    if (!stages.empty()) {
      stages.back().seconds += std::chrono::duration<double>(now - began).count();
      stages.back().peak_mb = resident_peak_mb();
    }
    began = now;
  };
  ImportOptions options;
  options.resolution = flags.resolution;
  options.quality = flags.normal ? TreeQuality::kNormal : TreeQuality::kHigh;
  const ImportedMap map = build_map(
      {name},
      [&](std::size_t) { return std::make_unique<MemoryReader>(cloud, flags.copies); },
      options,
      Executor(threads),
      [&](std::string_view what, double) {
        if (!stages.empty() && stages.back().what == what) return;
        close();
        stages.push_back({std::string(what)});
      });
  if (!flags.output.empty()) {
    close();
    stages.push_back({"writing"});
    write_map(OutputFile(flags.output), map.tree, map.description);
  }
  close();
  report = map.report;
  return stages;
}

int run(const Flags& flags) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const std::string& name : flags.scenes) {
    const ExactScene scene = load_scene(name);
    const MemoryCloud cloud = cloud_of(scene, flags);
    const double before = resident_peak_mb();
    for (const int threads : flags.threads) {
      ImportReport report;
      const auto stages = timed_import(cloud, name, flags, threads, report);
      double total = 0.0;
      nlohmann::ordered_json row = {{"scene", name},
                                    {"threads", threads},
                                    {"points", report.points_read},
                                    {"cells", report.cells},
                                    {"noise", report.noise}};
      for (const Stage& stage : stages) {
        total += stage.seconds;
        row["seconds"][stage.what] = stage.seconds;
      }
      row["seconds"]["all"] = total;
      row["peak_mb_before"] = before;
      row["peak_mb"] = resident_peak_mb();
      all.push_back(row);
      if (flags.json) continue;
      fmt::print("{}, {} thread(s): {:.1f} M points, {:.2f} M cells, r {} m, noise {:.1f} mm\n",
                 name,
                 threads,
                 1e-6 * static_cast<double>(report.points_read),
                 1e-6 * static_cast<double>(report.cells),
                 flags.resolution,
                 1e3 * report.noise);
      for (const Stage& stage : stages) {
        fmt::print("  {:28} {:7.3f} s {:8.2f} M points/s {:8.2f} M cells/s, peak {:.0f} MB\n",
                   stage.what,
                   stage.seconds,
                   1e-6 * static_cast<double>(report.points_read) / stage.seconds,
                   1e-6 * static_cast<double>(report.cells) / stage.seconds,
                   stage.peak_mb);
      }
      fmt::print("  {:28} {:7.3f} s {:8.2f} M points/s {:8.2f} M cells/s\n",
                 "all",
                 total,
                 1e-6 * static_cast<double>(report.points_read) / total,
                 1e-6 * static_cast<double>(report.cells) / total);
      fmt::print("  resident at most {:.0f} MB, {:.0f} MB of them before the import\n",
                 resident_peak_mb(),
                 before);
    }
  }
  if (flags.json) fmt::print("{}\n", all.dump(1));
  return 0;
}

}  // namespace
}  // namespace pointflight

int main(int argc, char** argv) {
  pointflight::Flags flags;
  CLI::App app("Times the stages of an import");
  app.add_option("--scenes", flags.scenes, "Exact scenes")->delimiter(',');
  app.add_option("--resolution", flags.resolution, "r, m");
  app.add_option("--noise", flags.noise, "Of the points, m");
  app.add_option("--points-per-cell", flags.points_per_cell, "Of a full one");
  app.add_option("--copies", flags.copies, "Of the scene, side by side");
  app.add_option("--threads", flags.threads, "Each in turn")->delimiter(',');
  app.add_option("--output", flags.output, "Write the last map there: .pfmap");
  app.add_flag("--normal", flags.normal, "As by --quality normal");
  app.add_flag("--json", flags.json, "Print JSON");
  CLI11_PARSE(app, argc, argv);
  try {
    return pointflight::run(flags);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
