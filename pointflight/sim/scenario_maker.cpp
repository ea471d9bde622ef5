#include "pointflight/sim/scenario_maker.hpp"

#include <fmt/format.h>

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/render/renderer.hpp"
#include "pointflight/sim/start_check.hpp"
#include "pointflight/world/free_space.hpp"

namespace pointflight {
namespace {

double rounded(double value) {
  return std::round(value * 100.0) / 100.0;
}

Vector3d rounded(const Vector3d& v) {
  return {rounded(v.x()), rounded(v.y()), rounded(v.z())};
}

/// With as much room as there is.
std::optional<Tour> tour_for(const ScenarioRequest& wish,
                             const std::shared_ptr<const SurfelMap>& map,
                             double radius,
                             const Executor& executor) {
  const auto renderer = make_renderer("beam", Scene{map});
  std::optional<Tour> tour;
  for (const double margin : {0.5, 0.3, 0.15}) {
    TourOptions options;
    options.radius = radius;
    options.margin = margin;
    options.length_min = wish.length;
    options.start = wish.start;
    options.bounds = wish.bounds;
    // as `scenario check` sees it
    options.accepts = [&](const Vector3d& p) { return !is_below_floor(*renderer, p); };
    auto found = find_tour(*map, options, executor);
    const bool is_better = found && (!tour || (found->has_ground && !tour->has_ground) ||
                                     found->length > 1.5 * tour->length);
    if (is_better) tour = std::move(found);
    if (tour && tour->has_ground && tour->length >= wish.length) break;
  }
  return tour;
}

}  // namespace

std::string box_text(const Aabb& box) {
  return fmt::format("{} and {}", point_text(box.min, 1), point_text(box.max, 1));
}

MadeScenario make_scenario(const ScenarioRequest& wish, const Executor& executor) {
  const std::shared_ptr<const SurfelMap>& map = wish.map;
  const VehicleSettings airframe = load_vehicle(wish.vehicle);
  load_lidar(wish.lidar);  // an unknown sensor is said before the search
  MadeScenario made;
  Scenario& scenario = made.scenario;
  scenario.map = wish.map_key;
  scenario.world = wish.world;
  VehicleSetup& flown = scenario.vehicles.front();
  flown.model = wish.vehicle;
  flown.lidars.front().model = wish.lidar;
  flown.mission.motion.speed = wish.speed;
  if (wish.start) flown.start = *wish.start;
  if (wish.start && !wish.mission) return made;
  const double radius = bounding_radius(airframe.hull());
  const std::optional<Tour> tour = tour_for(wish, map, radius, executor);
  if (!tour && wish.start) {
    // a start in a wall is refused by whoever flies
    if (!map->nearest(*wish.start, radius)) {
      made.notes.push_back(
          fmt::format("no way from {} was found: it hovers there; --mission gives one",
                      point_text(*wish.start)));
    }
    return made;
  }
  if (!tour) {
    throw InputError(fmt::format(
        "{}: no free place for a vehicle of radius {:.2f} m was found{}; write start and "
        "mission.waypoints yourself",
        scenario.map_name(),
        radius,
        wish.bounds ? fmt::format(" between {} (the map lies between {}; `map import "
                                  "--shift` moves it)",
                                  box_text(*wish.bounds),
                                  box_text(map->bounds_world()))
                    : std::string()));
  }
  if (!tour->has_ground) {
    made.notes.emplace_back("the map has no ground: the way is at any height that is free");
  }
  flown.start = rounded(tour->points_world.front());
  for (std::size_t i = 1; i < tour->points_world.size(); ++i) {
    flown.mission.waypoints.push_back(rounded(tour->points_world[i]));
  }
  const Vector3d first = flown.mission.waypoints.front() - flown.start;
  flown.start_yaw_deg = std::round(math::atan2(first.y(), first.x()) / kDegree);
  return made;
}

}  // namespace pointflight
