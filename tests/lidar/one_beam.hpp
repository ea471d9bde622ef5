// Returns of beams one by one, with draws that a test gives.
#pragma once

#include <vector>

#include "pointflight/lidar/return_model.hpp"

namespace pointflight::testing {

/// The random part of a beam; all its echoes and the air have the same.
struct BeamChance {
  double normal = 0.0, detection = 0.0, place = 0.0, drop = 0.0, drop_position = 0.0;
};

/// What the sensor reports of beams that hit `hit`, each with draws of its own: the first return.
inline std::vector<Return> measured(const ReturnModel& model,
                                    const Hit& hit,
                                    const std::vector<BeamChance>& chances) {
  const std::vector<Hit> hits(chances.size(), hit);
  std::vector<double> normal, detection, place;
  for (const BeamChance& chance : chances) {
    normal.push_back(chance.normal);
    detection.push_back(chance.detection);
    place.push_back(chance.place);
  }
  const auto more = [&](std::size_t beam, std::size_t) {
    const BeamChance& chance = chances[beam];
    return EchoChance{chance.normal, chance.detection, chance.drop, chance.drop_position};
  };
  const std::size_t most = most_returns(model.mode());
  std::vector<Return> all(hits.size() * most);
  model.measure(hits, {normal, detection, place, more}, all);
  std::vector<Return> first;
  for (std::size_t i = 0; i < hits.size(); ++i) first.push_back(all[i * most]);
  return first;
}

/// Of one beam.
inline Return measured(const ReturnModel& model, const Hit& hit, const BeamChance& chance) {
  return measured(model, hit, std::vector{chance})[0];
}

}  // namespace pointflight::testing
