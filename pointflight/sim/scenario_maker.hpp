#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/sim/scenario.hpp"

namespace pointflight {

/// What a scenario is made up from.
struct ScenarioRequest {
  std::shared_ptr<const SurfelMap> map;  ///< Where.
  std::string map_key;                   ///< What the scenario says: its path.
  std::optional<WorldMapOptions> world;  ///< Instead of a path: the world that the map is of.
  std::string lidar = "mid360";          ///< Name or path of a sensor file.
  std::string vehicle = "quad_330";      ///< Name or path of a vehicle file.
  double length = 60.0;                  ///< Of the mission, if the map allows, m.
  double speed = 2.0;                    ///< m/s
  std::optional<Vector3d> start;         ///< World, m; else a free position.
  std::optional<Aabb> bounds;            ///< World, m: start and waypoints lie inside.
  bool mission = true;                   ///< Else nothing is looked for if there is a start.
};

/// A scenario that was made up.
struct MadeScenario {
  Scenario scenario;               ///< As a file would have it.
  std::vector<std::string> notes;  ///< What the user should know of it, a line each.
};

/// A scenario for a map: a free start, waypoints and a heading along the first leg. A start that is
/// given stays, with waypoints or without. Throws InputError if no free position is found.
MadeScenario make_scenario(const ScenarioRequest& wish, const Executor& executor);

/// "1.0, 2.0, 3.0 and 4.0, 5.0, 6.0": the corners of a box, for messages.
std::string box_text(const Aabb& box);

}  // namespace pointflight
