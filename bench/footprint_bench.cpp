// What wide beams cost: a scan with lines and with as many sub-rays as it takes, in turns, on one
// thread, for two ways to report echoes. `./dev bench footprint MAP X,Y,Z`; see BENCHMARK.md.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <ctime>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/lidar/lidar.hpp"

namespace pointflight {
namespace {

struct Way {
  std::int64_t sub_rays;
  ReturnMode mode;
};
constexpr Way kWays[] = {
    {1, ReturnMode::kStrongest}, {0, ReturnMode::kStrongest}, {0, ReturnMode::kDual}};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void bench(const std::string& path, const std::vector<double>& place, int repeats) {
  const auto renderer = make_renderer("beam", Scene{SurfelMap::open(path)});
  const PoseTrack still(Pose{Quaterniond::Identity(), {place[0], place[1], place[2]}});
  const Executor executor(1);
  fmt::print(
      "{:<10} {:>8} {:>12} {:>10} {:>8}\n", "sensor", "beams", "line us/beam", "strongest", "dual");
  for (const char* name : {"os1_128", "vlp32c", "mid360", "avia"}) {
    std::vector<Lidar> lidars;
    for (const Way& way : kWays) {
      LidarSettings settings = load_lidar(name);
      settings.optics.sub_rays = way.sub_rays;
      settings.detection.returns = way.mode;
      lidars.emplace_back(settings, 0, nullptr, Surroundings{});
    }
    std::vector<std::vector<double>> seconds(std::size(kWays));
    std::size_t beams = 1;
    for (int r = 0; r < repeats; ++r) {
      for (std::size_t w = 0; w < std::size(kWays); ++w) {
        const std::clock_t start = std::clock();  // of the processor: others run beside it
        beams = lidars[w].take({}, still, *renderer, executor).beams;
        seconds[w].push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
      }
    }
    const double line = median(seconds[0]);
    fmt::print("{:<10} {:>8} {:>12.3f} {:>10.2f} {:>8.2f}\n",
               name,
               beams,
               1e6 * line / static_cast<double>(beams),
               median(seconds[1]) / line,
               median(seconds[2]) / line);
  }
}

}  // namespace
}  // namespace pointflight

int main(int argc, char** argv) {
  CLI::App app("What wide beams cost");
  std::string map;
  std::vector<double> place = {0.0, 0.0, 1.0};
  int repeats = 7;
  app.add_option("map", map, "A .pfmap")->required();
  app.add_option("place", place, "x,y,z of the sensor")->delimiter(',')->expected(3);
  app.add_option("--repeats", repeats, "Of each")->check(CLI::Range(1, 1000));
  CLI11_PARSE(app, argc, argv);
  try {
    pointflight::bench(map, place, repeats);
  } catch (const pointflight::InputError& e) {
    fmt::print(stderr, "footprint_bench: {}\n", e.what());
    return 2;
  }
}
