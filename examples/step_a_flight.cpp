// Steps a flight from a program and looks at its scans as they come. Run scan_a_room first.
#include <cstdio>
#include <exception>

#include "pointflight/sim/simulation.hpp"

using namespace pointflight;

class NearestReturn : public SampleSink {
 public:
  void on_sample(const Sample& sample) override {
    const auto* scanned = std::get_if<ScanSample>(&sample);
    if (scanned == nullptr) return;
    for (const ScanPoint& point : scanned->scan->points) nearest = std::min(nearest, point.range);
  }
  float nearest = 1e9f;
};

int main() try {
  Scenario scenario;
  scenario.map = "room.pfmap";
  scenario.vehicles[0].start = {2, 3, 1.5};
  scenario.vehicles[0].mission.waypoints = {{3.5, 3, 1.5}, {3.5, 1.5, 1.5}};
  const Executor executor;
  Simulation simulation(scenario, SurfelMap::open(scenario.map), executor);
  NearestReturn sink;
  while (simulation.step(sink)) {
  }
  std::printf("%s: %.1f m flown, nearest return %.2f m\n",
              to_string(simulation.end()),
              simulation.summary(0).distance_flown,
              static_cast<double>(sink.nearest));
  return simulation.end() == RunEnd::kCompleted ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
