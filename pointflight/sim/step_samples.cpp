#include "pointflight/sim/step_samples.hpp"

#include <algorithm>
#include <tuple>

namespace pointflight {

void deliver(std::span<StepSamples> samples, SampleSink& sink) {
  std::vector<StepSamples::Item*> due;
  for (StepSamples& s : samples) {
    for (CollisionEvent& event : s.collisions) {
      s.items.push_back({event.time, kCollisionRank, event});
    }
    // vehicles in their order, which sorting keeps
    for (StepSamples::Item& item : s.items) due.push_back(&item);
  }
  std::stable_sort(due.begin(), due.end(), [](const auto* a, const auto* b) {
    return std::tie(a->time, a->rank) < std::tie(b->time, b->rank);
  });
  for (const StepSamples::Item* item : due) sink.on_sample(item->sample);
}

}  // namespace pointflight
