// One frame of a Livox Avia in a map of a world, as the MARSIM paper measures its own (its figures
// 10 and 11, table II): `./dev bench worlds` runs this for each world, see BENCHMARK.md.
#include <fmt/format.h>
#include <time.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "pointflight/core/random.hpp"
#include "pointflight/fidelity/scene_beams.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/render/internal/direction_order.hpp"
#include "pointflight/scenes/made_world.hpp"
#include "pointflight/scenes/scene_space.hpp"

namespace pointflight {
namespace {

struct Flags {
  std::string world;
  std::string map;
  std::string poses_file;
  std::vector<std::string> renderers = {"beam", "opaque", "paper"};
  std::size_t poses = 10;
  std::uint64_t seed = 1;
  int repeats = 5;
  bool two_threads = true;
};

/// Positions (world, m) and yaws (rad).
using Place = std::array<double, 4>;

/// At random in what can be reached, 0.35 m and more from everything, at flight height.
std::vector<Place> places_in(const Flags& flags) {
  const auto options = world_named(flags.world);
  if (!options) throw std::runtime_error(flags.world + ": is no world");
  const SceneSpace space(make_world(*options), {}, Executor(0));
  const RandomStream random(flags.seed, StreamId::kScenePoses, 0);
  std::vector<Place> places;
  for (std::uint64_t i = 0; places.size() < flags.poses; ++i) {
    const auto [u, yaw] = random.uniform2(i);
    const auto cell = static_cast<std::size_t>(u * static_cast<double>(space.count()));
    if (!space.is_flyable(cell)) continue;
    const Vector3d p = space.center(cell);
    places.push_back({p.x(), p.y(), p.z(), 2.0 * std::numbers::pi * yaw});
  }
  return places;
}

double seconds_of(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// One way of rendering, and the least time that it took from each place.
struct Contestant {
  std::string name;
  std::unique_ptr<Renderer> renderer;
  int threads;
  std::vector<double> least;

  void render(const RayBatch& batch, std::vector<Hit>& hits, std::size_t place) {
    const clockid_t clock = threads == 1 ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC;
    const Executor executor(threads);
    const double start = seconds_of(clock);
    renderer->render(batch, hits, executor);
    least[place] = std::min(least[place], seconds_of(clock) - start);
  }
};

/// Most memory that the process had at once, MB (VmHWM; what is shared counts in full).
double peak_megabytes() {
  std::ifstream status("/proc/self/status");
  std::string word;
  double kilobytes = 0.0;
  while (status >> word) {
    if (word == "VmHWM:") status >> kilobytes;
  }
  return kilobytes / 1024.0;
}

/// "beam" as flights have it; "opaque" is the same without the opacities of surfels, "paper"
/// without them as well: as the paper has it.
std::unique_ptr<Renderer> renderer_of(const std::string& name, const Scene& scene) {
  if (name == "beam") return make_renderer(name, scene);
  return Choice<RendererKind>(name == "opaque" ? "beam" : name)->make(scene);
}

nlohmann::ordered_json measure(const Flags& flags, const std::vector<Place>& places) {
  const auto map = SurfelMap::open(flags.map);
  const BeamPlan plan = *table_beams("avia_grid");
  const auto order = direction_order(plan.directions_sensor, Executor(1));
  std::vector<Contestant> contestants;
  for (const std::string& name : flags.renderers) {
    for (int threads = 1; threads <= (flags.two_threads ? 2 : 1); ++threads) {
      contestants.push_back(
          {name, renderer_of(name, Scene{map}), threads, std::vector<double>(places.size(), 1e9)});
    }
  }
  std::vector<Hit> hits(plan.directions_sensor.size());
  for (int repeat = 0; repeat < flags.repeats; ++repeat) {
    for (std::size_t place = 0; place < places.size(); ++place) {
      const auto& [x, y, z, yaw] = places[place];
      RayBatch batch;
      batch.T_world_sensor = {quaternion_from_rpy(0.0, 0.0, yaw), Vector3d(x, y, z)};
      std::vector<Ray> rays;
      for (const Vector3f& d : plan.directions_sensor) {
        const Vector3d direction = batch.T_world_sensor.rotation * d.cast<double>();
        rays.push_back({Vector3d(x, y, z), direction.cast<float>(), plan.range_max});
      }
      batch.rays = rays;
      batch.order = order;
      batch.range_max = plan.range_max;
      for (Contestant& contestant : contestants) contestant.render(batch, hits, place);
    }
  }
  nlohmann::ordered_json frames = nlohmann::ordered_json::array();
  for (const Contestant& c : contestants) {
    double sum = 0.0;
    for (const double seconds : c.least) sum += seconds;
    frames.push_back({{"renderer", c.name},
                      {"threads", c.threads},
                      {"mean_ms", 1e3 * sum / static_cast<double>(places.size())},
                      {"most_ms", 1e3 * *std::max_element(c.least.begin(), c.least.end())}});
  }
  return {{"surfels", map->surfel_count()}, {"frames", frames}, {"peak_mb", peak_megabytes()}};
}

void run(const Flags& flags) {
  std::vector<Place> places;
  if (flags.world.empty()) {
    std::ifstream file(flags.poses_file);
    places = nlohmann::json::parse(file).at("poses").get<std::vector<Place>>();
  } else {
    places = places_in(flags);
  }
  auto result = measure(flags, places);
  result["poses"] = places;
  fmt::print("{}\n", result.dump());
}

}  // namespace
}  // namespace pointflight

int main(int argc, char** argv) {
  pointflight::Flags flags;
  bool one_thread = false;
  CLI::App app{"One frame of an Avia in the map of a world: time and memory"};
  app.add_option("map", flags.map, "MAP.pfmap of the world")->required();
  app.add_option("--world", flags.world, "Its name: poses are drawn in its free space");
  app.add_option("--poses", flags.poses_file, "Or the poses that such a run printed");
  app.add_option("--renderers", flags.renderers, "Some of: beam, opaque, paper")->delimiter(',');
  app.add_option("--count", flags.poses, "Poses");
  app.add_option("--seed", flags.seed, "Of poses");
  app.add_option("--repeats", flags.repeats, "Each pose is timed so often; the least counts");
  app.add_flag("--one-thread", one_thread, "Not on two as well");
  CLI11_PARSE(app, argc, argv);
  flags.two_threads = !one_thread;
  try {
    pointflight::run(flags);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
  return 0;
}
