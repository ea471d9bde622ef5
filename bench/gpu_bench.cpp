// Rays a second of the processor and of a GPU: one scan at a time and in batches, maps of 2, 20 and
// 100 million surfels. `./dev bench gpu`; see BENCHMARK.md.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "bench/tiled_map.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/gpu/gpu_list.hpp"
#include "pointflight/gpu/internal/device_queue.hpp"
#include "pointflight/gpu/internal/kernel_choice.hpp"
#include "pointflight/lidar/footprint.hpp"
#include "pointflight/lidar/return_model.hpp"
#include "pointflight/lidar/scan_beams.hpp"

namespace pointflight {
namespace {

using Json = nlohmann::ordered_json;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// The median of what `action` takes, s: of up to `most` times, as long as there are `seconds`.
double median_time(double seconds, int most, const std::function<void()>& action) {
  action();  // buffers grow, pages are read
  std::vector<double> times;
  const double until = now() + seconds;
  for (int i = 0; i < most && (i < 3 || now() < until); ++i) {
    const double start = now();
    action();
    times.push_back(now() - start);
    if (times.back() > seconds) break;
  }
  std::nth_element(
      times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2), times.end());
  return times[times.size() / 2];
}

/// Beams that all leave from one pose.
struct Pattern {
  std::string name;
  std::shared_ptr<const SensorBeams> beams;
  float range_max;
  std::shared_ptr<const ReturnModel> returns;  ///< Of wide beams; null: they are lines.
  std::shared_ptr<const Footprint> footprint;
};

/// "mid360", "mid360+wide" as it is shipped, "64x16".
Pattern pattern_of(const std::string& name) {
  const bool is_image = name == "64x16";
  const std::size_t plus = name.find('+');
  LidarSettings settings = load_lidar(is_image ? "marsim_grid" : name.substr(0, plus));
  if (is_image) {
    settings.grid.columns = 64;
    settings.grid.rows = 16;
    settings.range_max = 30.0;
  }
  const auto ordered = ScanBeams(settings).of(0, Executor());
  Pattern pattern{
      name, ordered->in_sensor, static_cast<float>(settings.range_max), nullptr, nullptr};
  if (plus == std::string::npos) return pattern;
  pattern.returns = std::make_shared<const ReturnModel>(settings, Surroundings{});
  pattern.footprint = std::make_shared<const Footprint>(settings.optics);
  pattern.range_max = static_cast<float>(pattern.returns->reach());
  return pattern;
}

/// As many scans from anywhere in the map, 2.5 to 7 m above its lowest point, tilted up to 11
/// degrees.
std::vector<AimedBeams> aims_of(const SurfelMap& map,
                                const Pattern& pattern,
                                std::size_t count,
                                std::uint64_t set) {
  const RandomStream random(1, StreamId::kTest, 0);
  const Aabb& box = map.bounds_world();
  std::vector<AimedBeams> aims;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t at = set << 32 | 6 * i;
    const Pose pose{quaternion_from_rpy(random.uniform(at, -0.2, 0.2),
                                        random.uniform(at + 1, -0.2, 0.2),
                                        random.uniform(at + 2, -3.1, 3.1)),
                    {random.uniform(at + 3, box.min.x(), box.max.x()),
                     random.uniform(at + 4, box.min.y(), box.max.y()),
                     box.min.z() + random.uniform(at + 5, 2.5, 7.0)}};
    aims.push_back(aim_beams(pattern.beams, {&pose, 1}, pattern.range_max));
  }
  return aims;
}

/// Scans of a pattern as jobs, other poses each time.
class Batch {
 public:
  static constexpr std::uint64_t kSets = 3;

  Batch(const SurfelMap& map, const Pattern& pattern, std::size_t scans, bool wants_ranges) {
    const std::size_t beams = pattern.beams->beams.size();
    rays_ = scans * beams;
    const bool is_wide = pattern.returns != nullptr;
    if (is_wide) {
      echoes_.resize(rays_);
    } else if (wants_ranges) {
      ranges_.resize(rays_);
    } else {
      hits_.resize(rays_);
    }
    for (std::uint64_t set = 0; set < kSets; ++set) {
      aims_.push_back(aims_of(map, pattern, scans, set));
      jobs_.emplace_back(scans);
      for (std::size_t i = 0; i < scans; ++i) {
        RenderJob& job = jobs_.back()[i];
        job.batch.aimed = &aims_.back()[i];
        job.batch.order = pattern.beams->order;
        if (is_wide) {
          job.wide = pattern.footprint->beams(
              {}, *pattern.returns, std::span(echoes_).subspan(i * beams, beams));
        } else if (wants_ranges) {
          job.ranges = std::span(ranges_).subspan(i * beams, beams);
        } else {
          job.hits = std::span(hits_).subspan(i * beams, beams);
        }
      }
    }
  }
  [[nodiscard]] std::span<const RenderJob> next() { return jobs_[number_++ % kSets]; }
  [[nodiscard]] std::size_t rays() const { return rays_; }
  /// Of each ray, or of each beam's first echo.
  [[nodiscard]] std::vector<float> ranges() const {
    if (echoes_.empty()) return ranges_;
    std::vector<float> all;
    for (const Echoes& echoes : echoes_) {
      all.push_back(echoes.count > 0 ? echoes.all[0].range : -1.0f);
    }
    return all;
  }
  void start_again() { number_ = 0; }

 private:
  std::vector<std::vector<AimedBeams>> aims_;
  std::vector<std::vector<RenderJob>> jobs_;
  std::vector<float> ranges_;
  std::vector<Hit> hits_;
  std::vector<Echoes> echoes_;
  std::size_t rays_ = 0;
  std::size_t number_ = 0;
};

struct Options {
  std::string map;
  std::string gpu;
  std::string json;
  std::vector<double> surfels{2e6, 20e6, 100e6};
  std::vector<std::size_t> scans{1, 16, 256, 1024, 4096};
  std::vector<std::string> patterns{
      "mid360", "os1_128", "marsim_grid", "64x16", "mid360+wide", "os1_128+wide"};
  double seconds = 0.5;
};

/// One map on the processor and on the device.
class Bench {
 public:
  Bench(const Options& options, std::shared_ptr<const SurfelMap> map, Json& rows)
      : options_(options), map_(std::move(map)), beam_(Scene{map_}), rows_(rows) {
    const GpuInfo info = find_gpu(options.gpu);
    auto device = GpuDevice::open(info);
    const auto kernel = exact_kernel(*device);
    if (!kernel) throw InputError(info.name + " has not this processor's bits");
    const double start = now();
    queue_ = std::make_unique<DeviceQueue>(std::move(device), *map_, *kernel);
    fmt::print("\n{:.1f} M surfels, {:.2f} GB, on the device after {:.1f} s\n",
               1e-6 * static_cast<double>(map_->surfel_count()),
               1e-9 * static_cast<double>(map_->file_size()),
               now() - start);
    fmt::print("{:>12} {:>6} {:>9} | {:>8} {:>8} {:>8} {:>8} | {:>8} {:>8} | {:>9} {:>7}\n",
               "pattern",
               "scans",
               "rays",
               "wall ms",
               "M/s",
               "kernel",
               "all M/s",
               "cpu 1",
               "cpu n",
               "gpu/cpu n",
               "unequal");
  }

  void measure(const Pattern& pattern) {
    const std::size_t beams = pattern.beams->beams.size();
    const double one = of_processor(pattern, 1, Executor(1));
    const Executor all;
    const double every =
        of_processor(pattern, std::max<std::size_t>(1, std::size_t{1} << 20) / beams + 1, all);
    for (const std::size_t scans : options_.scans) {
      // echoes take 150 bytes a beam
      const std::size_t most = pattern.returns ? kMostRays / 16 : kMostRays;
      if (scans * beams <= most) row(pattern, scans, one, every);
    }
  }

 private:
  static constexpr std::size_t kMostRays = 100'000'000;

  /// Rays a second, millions.
  double of_processor(const Pattern& pattern, std::size_t scans, const Executor& executor) {
    Batch batch(*map_, pattern, scans, true);
    const double time =
        median_time(options_.seconds, 50, [&] { beam_.render(batch.next(), executor); });
    return 1e-6 * static_cast<double>(batch.rays()) / time;
  }

  void on_device(Batch& batch, const Executor& executor) {
    DeviceBatch parts(batch.next(), beam_, queue_->at_once(), executor);
    DeviceQueue::Ticket ticket{&parts};
    queue_->start(ticket);
    queue_->finish(ticket);
    parts.finish();
  }

  /// How many of some scans' rays have other bits than the processor's.
  std::size_t count_unequal(const Pattern& pattern, std::size_t scans, const Executor& executor) {
    Batch batch(*map_, pattern, std::min<std::size_t>(scans, 16), true);
    on_device(batch, executor);
    const std::vector<float> got = batch.ranges();
    batch.start_again();
    beam_.render(batch.next(), executor);
    const std::vector<float> expected = batch.ranges();
    std::size_t unequal = 0;
    for (std::size_t i = 0; i < got.size(); ++i) unequal += got[i] != expected[i] ? 1 : 0;
    return unequal;
  }

  void row(const Pattern& pattern, std::size_t scans, double one, double every) {
    const Executor executor;
    Batch batch(*map_, pattern, scans, true);
    int runs = 0;
    const double before = queue_->kernel_time();
    const double wall = median_time(options_.seconds, 50, [&] {
      on_device(batch, executor);
      ++runs;
    });
    const double kernel = (queue_->kernel_time() - before) / runs;
    const auto rays = static_cast<double>(batch.rays());
    double everything = 0.0;
    if (!pattern.returns && batch.rays() <= (std::size_t{1} << 25)) {
      Batch whole(*map_, pattern, scans, false);
      everything = rays / median_time(options_.seconds, 20, [&] { on_device(whole, executor); });
    }
    const std::size_t unequal = count_unequal(pattern, scans, executor);
    fmt::print(
        "{:>12} {:>6} {:>9} | {:>8.3f} {:>8.1f} {:>8.1f} {:>8.1f} | {:>8.2f} {:>8.2f} | {:>9.1f} "
        "{:>7}\n",
        pattern.name,
        scans,
        batch.rays(),
        1e3 * wall,
        1e-6 * rays / wall,
        1e-6 * rays / kernel,
        1e-6 * everything,
        one,
        every,
        1e-6 * rays / wall / every,
        unequal);
    std::fflush(stdout);
    rows_.push_back({{"surfels", map_->surfel_count()},
                     {"pattern", pattern.name},
                     {"scans", scans},
                     {"rays", batch.rays()},
                     {"wall_s", wall},
                     {"kernel_s", kernel},
                     {"rays_per_s_with_all_fields", everything},
                     {"cpu_1", 1e6 * one},
                     {"cpu_all", 1e6 * every},
                     {"unequal", unequal}});
  }

  const Options& options_;
  std::shared_ptr<const SurfelMap> map_;
  BeamRenderer beam_;
  std::unique_ptr<DeviceQueue> queue_;
  Json& rows_;
};

void run(const Options& options) {
  const GpuInfo info = find_gpu(options.gpu);
  const auto device = GpuDevice::open(info);
  const auto kernel = exact_kernel(*device);
  fmt::print("{}, {}, Vulkan {}; exact by {}; {} threads of the processor\n",
             info.name,
             info.driver,
             info.api,
             kernel ? name_of(*kernel) : "nothing",
             Executor().threads());
  fmt::print(
      "wall: aims up, ranges (4 bytes a ray) back in the caller's memory; all: every field of a "
      "hit; "
      "M rays/s\n");
  const auto base = SurfelMap::open(options.map);
  std::vector<Pattern> patterns;
  for (const std::string& name : options.patterns) patterns.push_back(pattern_of(name));
  Json json{{"device", info.name},
            {"driver", info.driver},
            {"vulkan", info.api},
            {"threads", Executor().threads()},
            {"rows", Json::array()}};
  for (const double surfels : options.surfels) {
    const double copies = surfels / static_cast<double>(base->surfel_count());
    const int across = std::max(1, static_cast<int>(std::lround(std::sqrt(copies))));
    const int along = std::max(1, static_cast<int>(std::lround(copies / across)));
    try {
      Bench bench(options, tiled(*base, across, along), json["rows"]);
      for (const Pattern& pattern : patterns) bench.measure(pattern);
    } catch (const GpuError& error) {
      fmt::print("{:.1f} M surfels: {}\n", 1e-6 * surfels, error.what());
    }
  }
  if (!options.json.empty()) {
    OutputFile file(options.json);
    file.write(json.dump(1) + "\n");
    file.commit();
  }
}

}  // namespace
}  // namespace pointflight

int main(int argc, char** argv) {
  pointflight::Options options;
  CLI::App app("Rays a second on a GPU and on the processor");
  app.add_option("MAP", options.map, "what is repeated side by side")->required();
  app.add_option("--gpu", options.gpu, "index, or part of the name");
  app.add_option("--surfels", options.surfels, "of the maps")->delimiter(',');
  app.add_option("--scans", options.scans, "in a batch")->delimiter(',');
  app.add_option("--patterns", options.patterns, "LiDARs, with +wide as they are shipped, or 64x16")
      ->delimiter(',');
  app.add_option("--seconds", options.seconds, "for each figure");
  app.add_option("--json", options.json, "the figures");
  CLI11_PARSE(app, argc, argv);
  try {
    pointflight::run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "gpu_bench: {}\n", error.what());
    return 2;
  }
  return 0;
}
