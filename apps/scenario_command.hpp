#pragma once

#include <memory>
#include <optional>
#include <string>

#include "pointflight/core/parallel.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/sim/scenario.hpp"

namespace pointflight::apps {

/// What a scenario is made up from.
struct ScenarioWish {
  std::string map_path;  ///< Is opened.
  std::string map_key;   ///< What the scenario says.
  std::string lidar = "mid360";
  std::string vehicle = "quad_330";
  double length = 60.0;           ///< Of the mission, where the map allows, m.
  double speed = 2.0;             ///< m/s
  std::optional<Vector3d> start;  ///< World, m; else a free place.
  std::optional<Aabb> bounds;     ///< World, m: start and waypoints lie inside.
  bool mission = true;            ///< Else nothing is looked for where there is a start.
};

/// A scenario for a map: a free start, waypoints and a heading along the first leg. Throws
/// InputError where no free place is found.
Scenario make_scenario(const ScenarioWish& wish, const Executor& executor);

/// Says on stderr which vehicles start outside of a box (world, m).
void warn_of_starts_outside(const Scenario& scenario, const Aabb& box);

/// Says on stderr what is odd about a scenario (mission through the map, ...).
void warn_about(const Scenario& scenario, const SurfelMap& map);

}  // namespace pointflight::apps
