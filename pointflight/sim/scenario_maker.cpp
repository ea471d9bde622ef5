#include "pointflight/sim/scenario_maker.hpp"

#include <fmt/format.h>

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/world/free_space.hpp"

namespace pointflight {
namespace {

double rounded(double value) {
  return std::round(value * 100.0) / 100.0;
}

Vector3d rounded(const Vector3d& v) {
  return {rounded(v.x()), rounded(v.y()), rounded(v.z())};
}

}  // namespace

std::string box_text(const Aabb& box) {
  return fmt::format("{} and {}", point_text(box.min, 1), point_text(box.max, 1));
}

Scenario make_scenario(const ScenarioRequest& wish, const Executor& executor) {
  const auto map = SurfelMap::open(wish.map_path);
  const VehicleSettings airframe = load_vehicle(wish.vehicle);
  load_lidar(wish.lidar);  // an unknown sensor is said before the search
  Scenario scenario;
  scenario.map = wish.map_key;
  VehicleSetup& flown = scenario.vehicles.front();
  flown.model = wish.vehicle;
  flown.lidars.front().model = wish.lidar;
  flown.mission.motion.speed = wish.speed;
  if (wish.start && !wish.mission) {
    flown.start = *wish.start;
    return scenario;
  }
  std::optional<Tour> tour;
  for (const double margin : {0.5, 0.3, 0.15}) {
    TourOptions options;
    options.radius = bounding_radius(airframe.hull());
    options.margin = margin;
    options.length_min = wish.length;
    options.start = wish.start;
    options.bounds = wish.bounds;
    auto found = find_tour(*map, options, executor);
    if (found && (!tour || found->length > 1.5 * tour->length)) tour = std::move(found);
    if (tour && tour->length >= wish.length) break;
  }
  if (!tour) {
    throw InputError(fmt::format(
        "{}: no free place for a vehicle of radius {:.2f} m was found{}; write start and "
        "mission.waypoints yourself",
        wish.map_path,
        bounding_radius(airframe.hull()),
        wish.bounds ? fmt::format(" between {} (the map lies between {}; `map import "
                                  "--shift` moves it)",
                                  box_text(*wish.bounds),
                                  box_text(map->bounds_world()))
                    : std::string()));
  }
  flown.start = rounded(tour->points_world.front());
  for (std::size_t i = 1; i < tour->points_world.size(); ++i) {
    flown.mission.waypoints.push_back(rounded(tour->points_world[i]));
  }
  const Vector3d first = flown.mission.waypoints.front() - flown.start;
  flown.start_yaw_deg = std::round(math::atan2(first.y(), first.x()) / kDegree);
  return scenario;
}

}  // namespace pointflight
