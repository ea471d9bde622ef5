#pragma once

#include "pointflight/map/surfel_map.hpp"
#include "pointflight/sim/scenario.hpp"

namespace pointflight::apps {

/// Says on stderr which vehicles start outside of a box (world, m).
void warn_of_starts_outside(const Scenario& scenario, const Aabb& box);

/// Says on stderr what is odd about a scenario (mission through the map, ...).
void warn_about(const Scenario& scenario, const SurfelMap& map);

}  // namespace pointflight::apps
