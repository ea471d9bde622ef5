// What a scan, an import and a physics step cost, measured side by side in one run on one map: the
// machine may be shared, so read ratios, not milliseconds. See BENCHMARK.md.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "pointflight/core/random.hpp"
#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/io/pcd_writer.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"
#include "pointflight/render/internal/direction_order.hpp"
#include "pointflight/vehicle/controller.hpp"
#include "pointflight/vehicle/multirotor.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

/// A forest at 0.05 m, imported once, and where its files lie.
struct Bench {
  fs::path folder = fs::temp_directory_path() / "pointflight_bench";
  std::string cloud = (folder / "forest.pcd").string();
  std::string map_path = (folder / "forest.pfmap").string();
  std::uint64_t points = 0;
  std::shared_ptr<const SurfelMap> map;

  Bench() {
    fs::create_directories(folder);
    ForestOptions options;
    std::vector<CloudPoint> cloud_points;
    make_forest(options).sample(800.0, 0.005, 1, [&](const Vector3d& p) {
      cloud_points.push_back({p, 0.0f});
    });
    points = cloud_points.size();
    write_cloud_pcd(OutputFile(cloud), cloud_points, false);
    import(2);
    map = SurfelMap::open(map_path);
  }

  void import(int threads) const {
    ImportOptions options;
    options.resolution = 0.05;
    const ImportedMap imported = import_clouds({cloud}, options, Executor(threads));
    write_map(OutputFile(map_path), imported.tree, imported.description);
  }
};

const Bench& bench() {
  static const Bench instance;
  return instance;
}

void scan(benchmark::State& state, const char* lidar_name, const char* renderer_name) {
  bench();
  const Lidar lidar(load_lidar(lidar_name), 0);
  const auto renderer = make_renderer(renderer_name, Scene{bench().map});
  const Executor executor(static_cast<int>(state.range(0)));
  const Pose pose{Quaterniond::Identity(), {30, 30, 2}};
  std::uint64_t index = 0;
  std::size_t beams = 0;
  for (auto _ : state) {
    ScanRequest request;
    request.index = index++;
    const Scan result = lidar.take(request, PoseTrack(pose), *renderer, executor);
    beams += result.beams;
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(beams));
}
BENCHMARK_CAPTURE(scan, mid360_beam, "mid360", "beam")
    ->Arg(1)
    ->Arg(2)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(scan, mid360_paper, "mid360", "paper")
    ->Arg(1)
    ->Arg(2)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(scan, grid_beam, "marsim_grid", "beam")
    ->Arg(1)
    ->Arg(2)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(scan, grid_paper, "marsim_grid", "paper")
    ->Arg(1)
    ->Arg(2)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

/// A beam kernel of one instruction set, one thread, beams in the order of their directions.
void kernel(benchmark::State& state,
            const std::string& name,
            const std::string& lidar_name,
            BeamGrouping grouping) {
  bench();
  use_kernel(name);
  const Executor executor(1);
  const Lidar lidar(load_lidar(lidar_name), 0);
  const Vector3d origin(30, 30, 2);
  std::vector<Ray> rays;
  for (const Beam& beam : lidar.beams(0, executor)) {
    rays.push_back({origin, beam.direction_sensor, 40.0f});
  }
  const std::vector<std::uint32_t> order = direction_order(rays, executor);
  const KernelMap map = kernel_map_of(*bench().map);
  const std::vector<MapRay> in_map = map_rays(map, rays);
  std::vector<KernelHit> hits(rays.size());
  for (auto _ : state) benchmark::DoNotOptimize(trace_beams(map, in_map, order, hits, grouping));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(rays.size()));
  use_kernel("");
}

void register_kernels() {
  for (const std::string& name : kernel_names()) {
    for (const char* lidar : {"mid360", "marsim_grid"}) {
      const auto add = [&](const char* how, BeamGrouping grouping) {
        benchmark::RegisterBenchmark(
            fmt::format("kernel/{}/{}/{}", name, lidar, how).c_str(),
            [=](benchmark::State& state) { kernel(state, name, lidar, grouping); })
            ->Unit(benchmark::kMillisecond);
      };
      add("as_suits", BeamGrouping::kAutomatic);
      add("singly", BeamGrouping::kSingly);
    }
  }
}

void sort_beams(benchmark::State& state) {
  const Executor executor(1);
  const Lidar lidar(load_lidar("mid360"), 0);
  std::vector<Vector3f> directions;
  for (const Beam& beam : lidar.beams(0, executor)) directions.push_back(beam.direction_sensor);
  for (auto _ : state) benchmark::DoNotOptimize(direction_order(directions, executor));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(directions.size()));
}
BENCHMARK(sort_beams)->Unit(benchmark::kMillisecond);

void pattern(benchmark::State& state) {
  const Lidar lidar(load_lidar("mid360"), 0);
  const Executor executor(1);
  std::uint64_t index = 0;
  for (auto _ : state) benchmark::DoNotOptimize(lidar.beams(index++, executor));
}
BENCHMARK(pattern)->Unit(benchmark::kMillisecond);

void nearest(benchmark::State& state) {
  bench();
  const RandomStream random(1, StreamId::kTest, 0);
  std::uint64_t i = 0;
  for (auto _ : state) {
    const Vector3d p(random.uniform(3 * i, 5, 55),
                     random.uniform(3 * i + 1, 5, 55),
                     random.uniform(3 * i + 2, 0.5, 4));
    benchmark::DoNotOptimize(bench().map->nearest(p, 1.0));
    ++i;
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(nearest);

void open_map(benchmark::State& state) {
  bench();
  for (auto _ : state) benchmark::DoNotOptimize(SurfelMap::open(bench().map_path));
}
BENCHMARK(open_map)->Unit(benchmark::kMillisecond);

void import_cloud(benchmark::State& state) {
  for (auto _ : state) bench().import(static_cast<int>(state.range(0)));
  state.SetItemsProcessed(static_cast<std::int64_t>(bench().points) * state.iterations());
}
BENCHMARK(import_cloud)
    ->Arg(1)
    ->Arg(2)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1);

void physics_step(benchmark::State& state) {
  const VehicleSettings settings = load_vehicle("quad_330");
  const Multirotor vehicle(settings);
  const auto controller = make_controller("cascade", settings);
  ControllerMemory memory;
  VehicleState s = vehicle.hover_at({0, 0, 0}, 0.0);
  PositionCommand command;
  command.p_world = {1, 0, 0};
  for (auto _ : state) vehicle.step(s, controller->update(s.body, command, 1e-3, memory), 1e-3);
}
BENCHMARK(physics_step);

}  // namespace
}  // namespace pointflight

int main(int argc, char** argv) {
  pointflight::register_kernels();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
