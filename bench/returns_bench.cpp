// What the return model and the noise of directions cost beside rendering the same scan as lines,
// in turns, on one thread, with each instruction set. `./dev bench returns MAP X,Y,Z`; see
// BENCHMARK.md.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <ctime>
#include <memory>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"

namespace pointflight {
namespace {

/// Of this thread, seconds.
double cpu_time() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Times of one scan's parts, of the fastest repeat, seconds.
struct Times {
  double aim = 1e9;        ///< Without noise.
  double aim_noise = 1e9;  ///< With it.
  double render = 1e9;
  double finish = 1e9;  ///< Returns, and points of them.
  double ideal = 1e9;   ///< The same if all comes back without noise: writing points.
  std::size_t beams = 1;
};

void keep_least(double& least, double& since) {
  const double now = cpu_time();
  least = std::min(least, now - since);
  since = now;
}

Times times_of(const char* name, const Renderer& renderer, const PoseTrack& track, int repeats) {
  const Executor executor(1);
  LidarSettings settings = load_lidar(name);
  settings.optics.sub_rays = 1;
  const Lidar modelled(settings, 0, nullptr, Surroundings{});
  const Lidar ideal(settings, 0, nullptr, std::nullopt);
  Times times;
  for (int r = 0; r < repeats; ++r) {
    ScanRequest request;
    request.noise = false;
    double since = cpu_time();
    static_cast<void>(modelled.aim(request, track, renderer, executor));
    keep_least(times.aim, since);
    const auto plain = ideal.aim(request, track, renderer, executor);
    const RenderJob plain_job = plain->job();
    renderer.render({&plain_job, 1}, executor);
    since = cpu_time();
    times.beams = plain->finish(executor).beams;
    keep_least(times.ideal, since);
    request.noise = true;
    const auto scan = modelled.aim(request, track, renderer, executor);
    keep_least(times.aim_noise, since);
    const RenderJob job = scan->job();
    renderer.render({&job, 1}, executor);
    keep_least(times.render, since);
    static_cast<void>(scan->finish(executor));
    keep_least(times.finish, since);
  }
  return times;
}

void bench(const std::string& path,
           const std::vector<double>& place,
           const std::string& only,
           int repeats) {
  const auto renderer = make_renderer("beam", Scene{SurfelMap::open(path)});
  const PoseTrack still(Pose{Quaterniond::Identity(), {place[0], place[1], place[2]}});
  fmt::print("{:<10} {:<6} {:>8} {:>14} {:>12} {:>14} {:>10}\n",
             "sensor",
             "CPU",
             "beams",
             "render ns/beam",
             "returns ns",
             "directions ns",
             "share");
  for (const char* name : {"os1_128", "vlp32c", "mid360", "avia"}) {
    for (const std::string& kernel : kernel_names()) {
      if (!only.empty() && kernel != only) continue;
      use_kernel(kernel);
      const Times t = times_of(name, *renderer, still, repeats);
      const double beams = 1e-9 * static_cast<double>(t.beams);
      const double returns = t.finish - t.ideal;
      const double directions = t.aim_noise - t.aim;
      fmt::print("{:<10} {:<6} {:>8} {:>14.0f} {:>12.1f} {:>14.1f} {:>10.3f}\n",
                 name,
                 kernel,
                 t.beams,
                 t.render / beams,
                 returns / beams,
                 directions / beams,
                 (returns + directions) / t.render);
    }
  }
  use_kernel("");
}

}  // namespace
}  // namespace pointflight

int main(int argc, char** argv) {
  CLI::App app("What returns cost");
  std::string map;
  std::vector<double> place = {0.0, 0.0, 1.0};
  std::string only;
  int repeats = 15;
  app.add_option("map", map, "A .pfmap")->required();
  app.add_option("place", place, "x,y,z of the sensor")->delimiter(',')->expected(3);
  app.add_option("--cpu", only, "This instruction set alone: AVX2");
  app.add_option("--repeats", repeats, "Of each")->check(CLI::Range(1, 1000));
  CLI11_PARSE(app, argc, argv);
  try {
    pointflight::bench(map, place, only, repeats);
  } catch (const pointflight::InputError& e) {
    fmt::print(stderr, "returns_bench: {}\n", e.what());
    return 2;
  }
}
