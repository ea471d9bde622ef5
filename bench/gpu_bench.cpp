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

#include "bench/gpu_batches.hpp"
#include "bench/tiled_map.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/gpu/gpu_list.hpp"
#include "pointflight/gpu/gpu_renderer.hpp"
#include "pointflight/gpu/internal/device_queue.hpp"
#include "pointflight/gpu/internal/kernel_choice.hpp"
#include "pointflight/lidar/lidar.hpp"

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

  /// The paper's two ways, a scan at a time, beside ours: ms, with aims made by the host.
  void compare_with_paper() {
    if (map_->surfel_count() > kMostOfPaper) return;
    const auto paper = make_renderer("paper", Scene{map_});
    const auto on_gpu = make_gpu_paper_renderer(Scene{map_});
    const auto ours = make_gpu_renderer(Scene{map_});
    fmt::print("{:>12} | a scan, ms: {:>8} {:>8} | {:>8} | {:>8} {:>8}\n",
               "",
               "paper 1",
               "paper n",
               "gpu-paper",
               "beam n",
               "gpu");
    for (const char* name : {"mid360", "marsim_grid"}) {
      const Lidar lidar(load_lidar(name), 0);
      const Executor one(1);
      const Executor all;
      const double times[] = {time_of_scan(*paper, lidar, one),
                              time_of_scan(*paper, lidar, all),
                              time_of_scan(*on_gpu, lidar, all),
                              time_of_scan(beam_, lidar, all),
                              time_of_scan(*ours, lidar, all)};
      fmt::print("{:>12} | {:>11} {:>8.2f} {:>8.2f} | {:>9.2f} | {:>8.2f} {:>8.2f}\n",
                 name,
                 "",
                 1e3 * times[0],
                 1e3 * times[1],
                 1e3 * times[2],
                 1e3 * times[3],
                 1e3 * times[4]);
      std::fflush(stdout);
      rows_.push_back({{"surfels", map_->surfel_count()},
                       {"pattern", name},
                       {"paper_1_s", times[0]},
                       {"paper_all_s", times[1]},
                       {"gpu_paper_s", times[2]},
                       {"beam_all_s", times[3]},
                       {"gpu_s", times[4]}});
    }
  }

 private:
  static constexpr std::size_t kMostRays = 100'000'000;
  static constexpr std::size_t kMostOfPaper = 30'000'000;  // surfels: the paper's points take 60 B

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

  /// What one scan of a renderer takes, s: the median, from a few poses.
  double time_of_scan(const Renderer& renderer, const Lidar& lidar, const Executor& executor) {
    const Aabb& box = map_->bounds_world();
    std::vector<Hit> hits;
    std::uint32_t number = 0;
    return median_time(options_.seconds, 20, [&] {
      const RandomStream random(5, StreamId::kTest, number++ % 3);
      ScanRequest request;
      request.snapshot = true;
      const Pose pose{quaternion_from_rpy(0.0, 0.0, random.uniform(0, -3.1, 3.1)),
                      {random.uniform(1, box.min.x(), box.max.x()),
                       random.uniform(2, box.min.y(), box.max.y()),
                       box.min.z() + 3.0}};
      const auto exposure = lidar.aim(request, PoseTrack(pose), renderer, executor);
      RenderJob job = exposure->job();
      hits.resize(job.batch.size());
      job.hits = hits;
      job.wide.reset();
      renderer.render({&job, 1}, executor);
    });
  }

  const Options& options_;
  std::shared_ptr<const SurfelMap> map_;
  BeamRenderer beam_;
  std::unique_ptr<DeviceQueue> queue_;
  Json& rows_;
};

void run(const Options& options) {
  if (!options.gpu.empty()) choose_gpu(options.gpu);
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
      bench.compare_with_paper();
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
