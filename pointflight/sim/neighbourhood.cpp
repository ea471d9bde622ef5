#include "pointflight/sim/neighbourhood.hpp"

#include <algorithm>
#include <vector>

namespace pointflight {
namespace {

constexpr std::size_t kHullsPerChunk = 4;  // that one thread looks around from

/// A step of the run.
struct Step {
  SimTime before, now;
};

/// All vehicles that are there, where they were and are. From here on they were where they are.
std::vector<PlacedBody> placed(const Fleet& fleet, std::span<VehicleStatus> statuses) {
  std::vector<PlacedBody> vehicles;
  vehicles.reserve(fleet.size());
  for (std::size_t i = 0; i < fleet.size(); ++i) {
    VehicleStatus& status = statuses[i];
    if (!status.present) continue;
    const VehicleAgent& agent = fleet.vehicle(i);
    const Pose pose = status.state.body.T_world_body();
    ProximityState& known = status.proximity;
    vehicles.push_back({agent.label(),
                        &agent.shape(),
                        bounding_radius(agent.hull()),
                        known.started ? known.T_world_body : pose,
                        pose});
    if (fleet.flies_here(i)) continue;  // `sense_proximity` does so
    known.T_world_body = pose;
    known.started = true;
  }
  return vehicles;
}

/// Obstacles that are near enough to be hit or to be the nearest.
std::vector<Body> near_obstacles(const Neighbourhood& around,
                                 const PlacedBody& own,
                                 const Step& step) {
  const double moved = (own.now.translation - own.before.translation).norm();
  return around.obstacles.near(
      own.now.translation, own.radius + around.reach + moved, step.before, step.now);
}

/// Adds obstacles, which must outlive `bodies`.
void add_obstacles(std::span<const Body> obstacles,
                   const Step& step,
                   std::vector<PlacedBody>& bodies) {
  for (const Body& body : obstacles) {
    if (body.until <= step.now || body.from > step.now) continue;  // was replaced within the step
    const Pose pose = body.T_world_body(step.now);
    bodies.push_back({body.label,
                      &body.shape,
                      bounding_radius(body.shape),
                      body.from > step.before ? pose : body.T_world_body(step.before),
                      pose});
  }
}

void note_closest(VehicleStatus& status) {
  const auto& nearest = status.proximity.nearest;
  VehicleSummary& summary = status.summary;
  if (!nearest || status.crashed) return;
  if (summary.closest_approach && nearest->distance >= *summary.closest_approach) return;
  summary.closest_approach = nearest->distance;
  summary.closest_position_world = nearest->position_world;
  summary.closest_label = nearest->label;
}

/// What is near one hull. `bodies`: all vehicles; obstacles are added.
void sense_one(const Neighbourhood& around,
               const VehicleAgent& agent,
               const Step& step,
               std::vector<PlacedBody>& bodies,
               VehicleStatus& status,
               StepSamples& samples) {
  const auto own = std::find_if(bodies.begin(), bodies.end(), [&](const PlacedBody& body) {
    return body.label == agent.label();
  });
  ProximityQuery query;
  query.vehicle = agent.number();
  query.own_label = agent.label();
  query.hull = &agent.hull();
  query.T_world_body = own->now;
  query.now = step.now;
  query.step = around.step;
  query.reach = around.reach;
  query.ignores_map = status.landed || status.crashed;
  const std::vector<Body> obstacles = near_obstacles(around, *own, step);
  add_obstacles(obstacles, step, bodies);  // `own` is not valid any more
  sense_proximity(query, around.map, bodies, status.proximity, samples.collisions);
  note_closest(status);
  if (status.crashed) samples.collisions.clear();  // it is a wreck already
}

}  // namespace

void sense_neighbourhood(const Neighbourhood& neighbourhood,
                         SimTime now,
                         bool is_first,
                         std::span<VehicleStatus> statuses,
                         std::span<StepSamples> samples,
                         const Executor& executor) {
  const Fleet& fleet = neighbourhood.fleet;
  const Step step{is_first ? now : now - neighbourhood.step, now};
  const std::vector<PlacedBody> vehicles = placed(fleet, statuses);
  const auto& here = fleet.flying_here();
  executor.parallel_for(here.size(), kHullsPerChunk, [&](std::size_t begin, std::size_t end) {
    std::vector<PlacedBody> bodies = vehicles;
    for (const std::size_t i : std::span(here).subspan(begin, end - begin)) {
      bodies.resize(vehicles.size());  // without the obstacles near the one before
      sense_one(neighbourhood, fleet.vehicle(i), step, bodies, statuses[i], samples[i]);
    }
  });
}

}  // namespace pointflight
