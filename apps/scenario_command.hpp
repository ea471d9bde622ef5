#pragma once

#include <memory>
#include <string>

#include "pointflight/core/parallel.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/sim/scenario.hpp"

namespace pointflight::apps {

/// A scenario for a map: a free start, waypoints and a heading along the first leg. `map_path` is
/// opened; `map_key` is what the scenario says. Throws InputError where no free place is found.
Scenario make_scenario(const std::string& map_path,
                       const std::string& map_key,
                       const std::string& lidar,
                       const std::string& vehicle,
                       double length,
                       double speed,
                       const Executor& executor);

/// Says on stderr what is odd about a scenario (mission through the map, ...).
void warn_about(const Scenario& scenario, const SurfelMap& map);

}  // namespace pointflight::apps
