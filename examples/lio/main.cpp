// Flies a scenario and runs a small LiDAR-inertial odometry (odometry.hpp) on what its first
// vehicle measures: lio SCENARIO.yaml [--without-times] [-o ESTIMATE.tum]. Prints how far the
// estimate is from the truth in the end. `--without-times` takes all points of a scan as seen at
// its end: what an odometry gives away that does not de-skew.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <optional>
#include <string>

#include "examples/lio/judge.hpp"

using namespace pointflight;

constexpr const char* kUsage = "usage: lio SCENARIO.yaml [--without-times] [-o ESTIMATE.tum]";

int main(int count, char** words) try {
  std::string path;
  std::optional<std::ofstream> output;
  bool with_times = true;
  for (int i = 1; i < count; ++i) {
    if (std::strcmp(words[i], "--without-times") == 0) {
      with_times = false;
    } else if (std::strcmp(words[i], "-o") == 0 && i + 1 < count) {
      output.emplace(words[++i]);
      if (!*output) throw InputError(std::string(words[i]) + ": cannot be written");
    } else if (words[i][0] != '-' && path.empty()) {
      path = words[i];
    } else {
      throw InputError(kUsage);
    }
  }
  if (path.empty())
    throw InputError("usage: lio SCENARIO.yaml [--without-times] [-o ESTIMATE.tum]");
  const Scenario scenario = load_scenario(path);
  if (scenario.fleet().front().lidars.empty()) {
    throw InputError(path + ": the first vehicle has no LiDAR");
  }
  const Executor executor;
  Simulation simulation(scenario, scenario.open_map(), executor);
  lio::Judge judge(simulation.vehicle(0), with_times, output ? &*output : nullptr);
  while (simulation.step(judge)) {
  }
  std::printf(
      "%.1f m flown, %.2f rad/s at most; estimate off by %.3f m in the end (%.2f %% of the "
      "way), %.3f m at most, %.3f m RMS; %zu points in its map\n",
      judge.way(),
      judge.fastest_turn(),
      judge.last_error(),
      100.0 * judge.last_error() / std::max(judge.way(), 1e-9),
      judge.worst_error(),
      judge.rms_error(),
      judge.map_points());
  return simulation.end() == RunEnd::kCompleted ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
