// How many vehicles with a LiDAR each fly in real time, and what the time goes to: the same swarm
// with everything, without obstacles, without LiDARs. `./dev bench swarm MAP`; see BENCHMARK.md.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <chrono>
#include <fstream>
#include <memory>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "pointflight/render/internal/body_renderer.hpp"
#include "pointflight/render/internal/expanded_job.hpp"
#include "pointflight/sim/simulation.hpp"

namespace pointflight {
namespace {

struct Flags {
  std::string map;
  std::string lidar = "mid360";
  bool line = false;  ///< Beams are lines.
  std::vector<int> vehicles = {1, 10, 20};
  std::vector<int> threads = {1, 2};
  int obstacles = 50;
  double seconds = 5.0;
  bool without_map = false;  ///< What the map gives back costs nothing.
};

/// A device that takes no time: beams find something at 8 m. What it leaves to the processor is
/// what `gpu` leaves: bodies, noise, detection, points.
class Instant : public Renderer {
 public:
  explicit Instant(const Scene& scene) : beam_(scene) {}
  [[nodiscard]] std::size_t jobs_at_once() const override { return 32; }

 protected:
  static constexpr float kRange = 8.0f;  // m

  [[nodiscard]] bool makes_rays() const override { return true; }
  void render_one(const RenderJob& job, const Executor& executor) const override {
    const ExpandedJob expanded(job, executor);
    for (Hit& hit : expanded.job().hits) hit = {kRange, 0.7f, 0.0f, kMapLabel, 0};
    render_bodies(expanded.job().batch, expanded.job().hits, executor);
    expanded.finish();
  }
  void render_wide(const RenderJob& job, const Executor& executor) const override {
    Echoes one;
    one.count = 1;
    one.all_hit = true;
    one.all[0].range = kRange;
    one.all[0].reflectivity = 0.3f;
    one.all[0].parts = 8;
    one.all[0].origin = {0.7f, 0, 0};
    std::fill(job.wide->echoes.begin(), job.wide->echoes.end(), one);
    beam_.finish_cones(job, {}, executor);
  }

 private:
  BeamRenderer beam_;
};

/// Takes everything and keeps nothing.
class Nothing : public SampleSink {
  void on_sample(const Sample& /*sample*/) override {}
};

/// Vehicles at free positions that fly 8 m and back, and obstacles.
Scenario scenario_for(const Flags& flags, const SurfelMap& map, int vehicles) {
  Scenario s;
  s.duration = flags.seconds;
  const Aabb& box = map.bounds_world();
  const RandomStream random(1, StreamId::kTest, 900);
  std::uint64_t index = 0;
  while (static_cast<int>(s.vehicles.size()) < vehicles + 1) {  // one is there from the start
    const auto [u, v] = random.uniform2(index++);
    const Vector3d p(box.min.x() + u * box.size().x(), box.min.y() + v * box.size().y(), 2.5);
    const Vector3d goal = p + Vector3d(8.0, 0.0, 0.0);
    bool clear = !map.nearest(p, 0.6).has_value();
    for (const VehicleSetup& other : s.vehicles) clear = clear && (other.start - p).norm() > 1.5;
    if (!clear) continue;
    VehicleSetup setup;
    setup.start = p;
    setup.lidars.front().model = flags.lidar;
    if (flags.line) setup.lidars.front().sub_rays = 1;
    if (flags.without_map) setup.lidars.front().renderer = "instant";
    setup.mission.waypoints = {goal, p};
    s.vehicles.push_back(setup);
  }
  s.vehicles.erase(s.vehicles.begin());
  ObstacleSettings balls;
  balls.count = flags.obstacles;
  balls.size.radius = 0.2;
  balls.radius_max = 0.6;
  balls.speed_max = 2.0;
  if (flags.obstacles > 0) s.obstacles = {balls};
  s.air.wind.turbulence = Turbulence::kLight;
  return s;
}

/// Resident memory that is the process' own (not pages of the map's file), MB.
double own_memory_mb() {
  std::ifstream file("/proc/self/status");
  std::string word;
  double kb = 0.0;
  while (file >> word) {
    if (word == "RssAnon:") file >> kb;
  }
  return kb * 1024e-6;
}

struct Timed {
  double seconds;    ///< Wall clock.
  double memory_mb;  ///< Own, at the end of the run.
};

Timed timed(const Scenario& scenario,
            const std::shared_ptr<const SurfelMap>& map,
            const Executor& executor) {
  Simulation simulation(scenario, map, executor);
  Nothing sink;
  const auto start = std::chrono::steady_clock::now();
  while (simulation.step(sink)) {
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  return {took.count(), own_memory_mb()};
}

void run(const Flags& flags) {
  const auto map = SurfelMap::open(flags.map);
  fmt::print("{}: {:.2f} M surfels; {} at 10 Hz, {} obstacles, gusts; {} s flown\n",
             flags.map,
             static_cast<double>(map->surfel_count()) * 1e-6,
             flags.lidar,
             flags.obstacles,
             flags.seconds);
  fmt::print(
      "| vehicles | threads | real-time factor | ms a simulated second: all | scans | seeing "
      "bodies | flying, contacts | own memory MB |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const int vehicles : flags.vehicles) {
    const Scenario all = scenario_for(flags, *map, vehicles);
    Scenario alone = all;  // nothing that moves to be seen; vehicles still see each other
    alone.obstacles.clear();
    Scenario blind = all;
    for (VehicleSetup& v : blind.vehicles) v.lidars.clear();
    for (const int threads : flags.threads) {
      const Executor executor(threads);
      const auto [everything, memory] = timed(all, map, executor);
      const double without = timed(alone, map, executor).seconds;
      const double flying = timed(blind, map, executor).seconds;
      const double each = 1e3 / flags.seconds;
      fmt::print("| {} | {} | {:.2f} | {:.0f} | {:.0f} | {:.0f} | {:.0f} | {:.0f} |\n",
                 vehicles,
                 threads,
                 flags.seconds / everything,
                 each * everything,
                 each * (std::min(without, everything) - flying),
                 each * std::max(0.0, everything - without),
                 each * flying,
                 memory);
      std::fflush(stdout);
    }
  }
}

}  // namespace
}  // namespace pointflight

int main(int argc, char** argv) {
  CLI::App app{"Real-time factor of swarms"};
  pointflight::Flags flags;
  app.add_option("map", flags.map, "A .pfmap")->required();
  app.add_option("--lidar", flags.lidar, "A shipped sensor")->capture_default_str();
  app.add_flag("--line", flags.line, "Beams are lines");
  app.add_option("--vehicles", flags.vehicles, "Numbers of them")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--threads", flags.threads, "Numbers of them")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--obstacles", flags.obstacles, "Balls that move")->capture_default_str();
  app.add_option("--seconds", flags.seconds, "Flown")->capture_default_str();
  app.add_flag("--without-map",
               flags.without_map,
               "The map is rendered at no cost: what a processor has to do beside a GPU");
  CLI11_PARSE(app, argc, argv);
  pointflight::RendererKind::table().add({.name = "instant",
                                          .help = "nothing",
                                          .make =
                                              [](const pointflight::Scene& scene) {
                                                return std::make_unique<pointflight::Instant>(
                                                    scene);
                                              },
                                          .one_pose = false});
  try {
    pointflight::run(flags);
  } catch (const pointflight::InputError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
  return 0;
}
