#include "pointflight/sim/start_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>

#include "pointflight/core/input_error.hpp"

namespace pointflight {

void check_names(const Scenario& scenario, const std::vector<VehicleSetup>& fleet) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < fleet.size(); ++i) {
    const std::string& name = fleet[i].name;
    const bool plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
      return std::isalnum(c) != 0 || c == '_' || c == '-';
    });
    if (plain && names.insert(name).second) continue;
    throw InputError(fmt::format("{}: '{}' {}",
                                 scenario.place(scenario.vehicle_key(i, "name")),
                                 name,
                                 plain ? "is the name of two vehicles; give each its own"
                                       : "names a folder: letters, digits, _ and - only"));
  }
}

void check_start_is_free(const Scenario& scenario,
                         const SurfelMap& map,
                         const StartingVehicle& vehicle,
                         std::span<const StartingVehicle> others,
                         std::span<const Body> obstacles) {
  const VehicleAgent& agent = *vehicle.agent;
  const Pose& pose = vehicle.T_world_body;
  const Vector3d& p = pose.translation;
  const std::string key = scenario.vehicle_key(agent.number(), "start");
  const auto fail = [&](const std::string& what) {
    throw InputError(fmt::format("{}: {}: {}", scenario.place(key), key, what));
  };
  const std::string& name = agent.setup().name;
  const auto here = contact_with_map(map, agent.hull(), pose, 0.0);
  if (here && here->distance < 0.0) {
    fail(fmt::format(
        "({:.2f}, {:.2f}, {:.2f}) of {} is {:.2f} m inside the map for a hull that "
        "reaches {:.2f} m; move it, or let `pointflight scenario new` find a free place",
        p.x(),
        p.y(),
        p.z(),
        name,
        -here->distance,
        bounding_radius(agent.hull())));
  }
  for (const StartingVehicle& other : others) {
    const double apart =
        separation(agent.hull(), pose, other.agent->hull(), other.T_world_body).distance;
    if (apart > 0.0) continue;
    fail(fmt::format(
        "{} starts {:.2f} m inside {}; move one of them", name, -apart, other.agent->setup().name));
  }
  for (const Body& body : obstacles) {
    const auto met = contact_with_body(
        body.shape, body.T_world_body(SimTime{}), body.label, agent.hull(), pose, 0.0);
    if (!met || met->distance > 0.0) continue;
    fail(fmt::format("{} starts {:.2f} m inside obstacle {}; move one of them",
                     name,
                     -met->distance,
                     body.label - kFirstObstacle));
  }
}

}  // namespace pointflight
