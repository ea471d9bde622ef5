#include "pointflight/sim/start_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <set>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/render/renderer.hpp"
#include "pointflight/sim/simulation.hpp"
#include "pointflight/world/free_space.hpp"

namespace pointflight {
namespace {

constexpr double kBeside = 50.0;  // m outside of the map's bounds, and below
constexpr double kAbove = 500.0;  // m

std::string free_place_text(const SurfelMap& map,
                            const VehicleAgent& agent,
                            const Vector3d& p,
                            const Executor& executor) {
  const auto place = nearest_free_position(map, p, bounding_radius(agent.hull()), executor);
  return place ? "; the nearest free position found is " + point_text(*place) : std::string();
}

/// How far the map is along the vertical, by rays side by side: a surface may have holes.
std::optional<double> vertical_distance(const Renderer& renderer, const Vector3d& p, float up) {
  constexpr double kApart = 0.3;  // m
  std::optional<double> least;
  for (const double x : {-kApart, 0.0, kApart}) {
    for (const double y : {-kApart, 0.0, kApart}) {
      Ray ray;
      ray.origin_world = p + Vector3d(x, y, 0.0);
      ray.direction_world = Vector3f(0.0f, 0.0f, up);
      ray.range_max = 1e4f;
      const Hit hit = renderer.trace(ray);
      if (hit.is_return() && !(least && *least < static_cast<double>(hit.range))) {
        least = static_cast<double>(hit.range);
      }
    }
  }
  return least;
}

}  // namespace

bool is_below_floor(const Renderer& renderer, const Vector3d& p_world) {
  return !vertical_distance(renderer, p_world, -1.0f) && vertical_distance(renderer, p_world, 1.0f);
}

Vector3d standing_below(const Renderer& renderer, const Solid& hull, const Vector3d& p_world) {
  constexpr double kAbove = 0.02;  // m: surfels have a thickness
  const auto ground = vertical_distance(renderer, p_world, -1.0f);
  if (!ground) return p_world;
  return p_world + Vector3d(0.0, 0.0, half_extent(hull).z() + kAbove - *ground);
}

bool is_lost(const SurfelMap& map, const Vector3d& p_world) {
  if (map.surfel_count() == 0) return false;
  const Aabb& b = map.bounds_world();
  const Vector3d below = b.min - p_world;
  const Vector3d above = p_world - b.max;
  return below.maxCoeff() > kBeside || above.head<2>().maxCoeff() > kBeside || above.z() > kAbove;
}

void require_own_autopilots(const Scenario& scenario) {
  for (std::size_t i = 0; i < scenario.vehicles.size(); ++i) {
    const VehicleSetup& vehicle = scenario.vehicles[i];
    if (vehicle.autopilot.kind == AutopilotKind::kOwn) continue;
    throw InputError(fmt::format(
        "{}: a firmware flies '{}' (autopilot): only `pointflight fly` lets one connect",
        scenario.location(scenario.vehicle_key(i, "autopilot")),
        vehicle.name));
  }
}

void check_names(const Scenario& scenario, const std::vector<VehicleSetup>& fleet) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < fleet.size(); ++i) {
    const std::string& name = fleet[i].name;
    const bool plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
      return std::isalnum(c) != 0 || c == '_' || c == '-';
    });
    if (plain && names.insert(name).second) continue;
    throw InputError(fmt::format("{}: '{}' {}",
                                 scenario.location(scenario.vehicle_key(i, "name")),
                                 name,
                                 plain ? "is the name of two vehicles; give each its own"
                                       : "names a folder: letters, digits, _ and - only"));
  }
}

void check_reach(const Scenario& scenario, const std::vector<VehicleSetup>& fleet) {
  for (std::size_t i = 0; i < fleet.size(); ++i) {
    std::vector<Vector3d> places = fleet[i].mission.waypoints;
    places.push_back(fleet[i].start);
    for (const CommandSettings& command : fleet[i].commands) places.push_back(command.vector);
    for (const Vector3d& p : places) {
      if (p.cwiseAbs().maxCoeff() <= kFarthest) continue;
      throw InputError(fmt::format(
          "{}: copy_offset takes {} to ({:g}, {:g}, {:g}); {:g} m from the origin at most",
          scenario.location(scenario.vehicle_key(i, "copy_offset")),
          fleet[i].name,
          p.x(),
          p.y(),
          p.z(),
          kFarthest));
    }
  }
}

void check_start_is_free(const Scenario& scenario,
                         const SurfelMap& map,
                         const StartingVehicle& vehicle,
                         std::span<const StartingVehicle> others,
                         std::span<const Body> obstacles,
                         const Executor& executor) {
  const VehicleAgent& agent = *vehicle.agent;
  const Pose& pose = vehicle.T_world_body;
  const Vector3d& p = pose.translation;
  const std::string key = scenario.vehicle_key(agent.number(), "start");
  const auto fail = [&](const std::string& what) {
    throw InputError(fmt::format("{}: {}: {}", scenario.location(key), key, what));
  };
  const std::string& name = agent.setup().name;
  if (is_lost(map, p)) {
    const Aabb& b = map.bounds_world();
    fail(fmt::format("{} of {} is outside of the map, which lies between {} and {}{}",
                     point_text(p),
                     name,
                     point_text(b.min),
                     point_text(b.max),
                     free_place_text(map, agent, p, executor)));
  }
  const auto here = contact_with_map(map, agent.hull(), pose, 0.0);
  if (here && here->distance < 0.0) {
    fail(fmt::format(
        "({}, {}, {}) of {} is {:.2f} m inside the map for a hull that "
        "reaches {:.2f} m; move it, or let `pointflight scenario new` find a free position",
        fixed_text(p.x(), 2),
        fixed_text(p.y(), 2),
        fixed_text(p.z(), 2),
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

std::vector<std::string> start_warnings(const Simulation& simulation, const Executor& executor) {
  const SurfelMap& map = simulation.map();
  const Scenario& scenario = simulation.scenario();
  const auto renderer = make_renderer("beam", Scene{simulation.shared_map()});
  std::vector<std::string> warnings;
  for (std::size_t i = 0; i < simulation.vehicle_count(); ++i) {
    const VehicleAgent& agent = simulation.vehicle(i);
    const Vector3d& p = agent.setup().start;
    const double radius = bounding_radius(agent.hull());
    const auto ground = vertical_distance(*renderer, p, -1.0f);
    std::string what;
    if (is_below_floor(*renderer, p)) {
      what = "is below the floor: the map is above it and nothing below";
    } else if (agent.setup().landed && (!ground || *ground > radius + map.resolution())) {
      what = ground ? fmt::format("starts landed, but the ground is {:.2f} m below", *ground)
                    : std::string("starts landed, but there is no ground below");
    }
    if (what.empty()) continue;
    // the search is slow: the first few show where to look, a swarm of hundreds would wait
    const std::string place =
        warnings.size() < 3 ? free_place_text(map, agent, p, executor) : std::string();
    warnings.push_back(fmt::format("{}: warning: {} of {} {}{}",
                                   scenario.location(scenario.vehicle_key(i, "start")),
                                   point_text(p),
                                   agent.setup().name,
                                   what,
                                   place));
  }
  return warnings;
}

}  // namespace pointflight
