#include "pointflight/learn/flights.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/vehicle/vehicle_shape.hpp"
#include "pointflight/world/contact.hpp"

namespace pointflight {
namespace {

constexpr double kMargin = 0.01;          // m: clearance is looked for again before it is used up
constexpr std::size_t kMostTries = 200;   // for each position that is wanted
constexpr std::size_t kGroupsAtOnce = 2;  // of vehicles, on one thread
constexpr std::size_t kGroup = FlightBatch::kGroup;

VehicleSettings under_geometric_control(VehicleSettings vehicle) {
  vehicle.controller.kind = "geometric";
  return vehicle;
}

/// The others of a team.
Body seen_as(const VehicleSettings& vehicle) {
  Body body;
  body.shape = vehicle.hull();
  body.intensity = static_cast<float>(vehicle.intensity);
  if (!vehicle.airframe.seen_as_hull) {
    body.look = std::make_shared<const Assembly>(assembly_of(vehicle));
  }
  return body;
}

/// How often `part` goes into `whole`. Throws std::invalid_argument if it does not.
int whole_parts(double whole, double part, const char* what) {
  const double count = std::round(whole / part);
  require_argument(count >= 1.0 && count < 1e6 && std::abs(count * part - whole) < 1e-9 * whole,
                   what);
  return static_cast<int>(count);
}

}  // namespace

Flights::Flights(std::shared_ptr<const SurfelMap> map,
                 const VehicleSettings& vehicle,
                 std::size_t count,
                 const FlightsOptions& options,
                 RangePattern pattern)
    : map_(std::move(map)),
      renderer_(make_renderer(options.renderer, Scene{map_})),
      batch_(under_geometric_control(vehicle), count, options.timing),
      options_(options),
      pattern_(std::move(pattern)),
      hull_(vehicle.hull()),
      hull_radius_(bounding_radius(hull_)),
      periods_(whole_parts(options.action_period,
                           batch_.control_period(),
                           "Flights: an action takes a whole number of control periods")),
      watch_(count),
      poses_(count) {
  require_argument(
      options.look_every > 0.0 && options.speed_max >= 0.0 && options.obstacle_speed >= 0.0,
      "Flights: look_every above 0, speeds not below");
  require_argument(kGroup % options.team == 0 && count % options.team == 0,
                   "Flights: teams of 1, 2, 4 or 8, and whole ones");
  const double most = vehicle.controller.speed_max;
  const double speed = options.speed_max > 0.0 ? std::min(options.speed_max, most) : most;
  const double theirs = std::max(options.obstacle_speed, options.team > 1 ? speed : 0.0);
  const double way = (speed + theirs) * options.action_period;
  looks_ = std::clamp(static_cast<int>(std::ceil(way / options.look_every)), 1, periods_);
  if (options.wind.turbulence != Turbulence::kNone) gusts_.resize(count);
  if (options.team > 1 || options.obstacles) traffic_.emplace(options.obstacles, seen_as(vehicle));
  for (std::size_t i = 0; i < count; ++i) place(i, {});
}

void Flights::place(std::size_t i, const FlightStart& start) {
  RigidBodyState body;
  body.p_world = start.p_world;
  body.q_world_body = quaternion_from_rpy(0.0, 0.0, start.yaw);
  batch_.place(i, body);
  batch_.set_air(i, start.wind_world, FlightBatch::kFarBelow);
  batch_.set_load(i, start.load_share);
  watch_[i] = Watch{};
  watch_[i].last = body.T_world_body();
  watch_[i].time = start.time;
  watch_[i].draws.seed = start.seed;
  poses_[i] = {watch_[i].last, watch_[i].last, start.time, start.time};
  if (!gusts_.empty()) gusts_[i] = {start.wind_world, start.seed, {}, 0};
}

void Flights::set_rotor(std::size_t i, std::size_t rotor, double share) {
  require_argument(rotor < vehicle().rotors.size() && share >= 0.0 && share <= 1.0,
                   "Flights::set_rotor: a rotor, and a share from 0 to 1");
  batch_.set_rotor(i, rotor, share);
}

double Flights::clearance_of_obstacles(const Vector3d& p_world, SimTime time) const {
  if (!options_.obstacles) return kReach;
  const Pose at{Quaterniond::Identity(), p_world};
  return traffic_->clearance(std::span(&at, 1), 0, time, kReach);
}

void Flights::ask(std::size_t i, std::span<const double> action) {
  if (options_.level == FlightLevel::kRotorSpeeds) {
    batch_.ask_rotors(i, action.data());
    return;
  }
  const Vector3d asked(action[0], action[1], action[2]);
  if (options_.level == FlightLevel::kBodyRates) {
    batch_.ask(i, asked, action[3]);
    return;
  }
  const auto heading = math::sincos(batch_.yaw(i));
  batch_.ask(i,
             {heading.cos * asked.x() - heading.sin * asked.y(),
              heading.sin * asked.x() + heading.cos * asked.y(),
              asked.z()},
             action[3]);
}

/// The wind until the next look.
void Flights::blow(std::size_t i, double seconds) {
  Gusts& gusts = gusts_[i];
  WindSettings settings = options_.wind;
  settings.mean = gusts.mean;
  const RigidBodyState body = batch_.body(i);
  const double height = body.p_world.z() - map_->bounds_world().min.z();
  const Vector3d wind =
      Wind(settings, gusts.seed)
          .over_step(gusts.state, 0, gusts.looks++, seconds, body.v_world, height);
  batch_.set_air(i, wind, FlightBatch::kFarBelow);
}

/// After it has moved on; its surroundings are looked at again before the clearance is used up.
void Flights::follow(std::size_t i, Duration passed) {
  Watch& watch = watch_[i];
  watch.time += passed;
  const RigidBodyState body = batch_.body(i);
  if (!body.is_finite()) {
    watch.status.collided = true;
    return;
  }
  const Pose now = body.T_world_body();
  watch.travelled += motion_bound(watch.last, now, hull_radius_);
  watch.status.flown += (now.translation - watch.last.translation).norm();
  watch.last = now;
  if (watch.known - watch.travelled < kMargin) look(watch);
  if (watch.known <= 0.0) watch.status.collided = true;
}

void Flights::look(Watch& watch) const {
  const auto contact = contact_with_map(*map_, hull_, watch.last, kReach);
  watch.known = contact ? contact->distance : kReach;
  watch.travelled = 0.0;
}

/// For what moves; all of its team have been followed.
void Flights::look_around(std::size_t i) {
  const std::size_t first = i / options_.team * options_.team;
  std::array<Pose, kGroup> team;
  for (std::size_t k = 0; k < options_.team; ++k) team[k] = watch_[first + k].last;
  Watch& watch = watch_[i];
  watch.apart =
      traffic_->clearance(std::span(team.data(), options_.team), i - first, watch.time, kReach);
  if (watch.apart <= 0.0) watch.status.collided = true;
}

/// One action of the vehicles of a group.
void Flights::fly_group(std::size_t first,
                        std::span<const double> actions,
                        std::span<const std::uint8_t> moves) {
  const std::size_t last = std::min(first + kGroup, size());
  const std::size_t numbers = actions.size() / size();
  const auto stands = [&](std::size_t i) { return !moves.empty() && moves[i] == 0; };
  std::vector<double> kept(batch_.column_size() * kGroup);
  const auto column = [&](std::size_t i) {
    return std::span(kept).subspan((i - first) * batch_.column_size(), batch_.column_size());
  };
  const auto for_moving = [&](const auto& action) {
    for (std::size_t i = first; i < last; ++i) {
      if (!stands(i)) action(i);
    }
  };
  for (std::size_t i = first; i < last; ++i) {
    if (stands(i)) batch_.save(i, column(i));
  }
  for_moving([&](std::size_t i) {
    ask(i, actions.subspan(i * numbers, numbers));
    poses_[i].before = watch_[i].last;
    poses_[i].before_time = watch_[i].time;
    ++watch_[i].draws.scan;
  });
  for (int k = 0; k < looks_; ++k) {
    const int periods = periods_ * (k + 1) / looks_ - periods_ * k / looks_;
    const double seconds = periods * batch_.control_period();
    if (!gusts_.empty()) for_moving([&](std::size_t i) { blow(i, seconds); });
    batch_.fly(first / kGroup, options_.level, periods);
    for_moving([&](std::size_t i) { follow(i, from_seconds(seconds)); });
    if (traffic_) for_moving([&](std::size_t i) { look_around(i); });
  }
  for_moving([&](std::size_t i) {
    Watch& watch = watch_[i];
    if (watch.travelled > 0.0 && watch.known - watch.travelled < kExact) look(watch);
    watch.status.clearance = std::min(watch.known - watch.travelled, watch.apart);
    if (watch.known <= 0.0) watch.status.collided = true;
    poses_[i].now = watch.last;
    poses_[i].time = watch.time;
  });
  for (std::size_t i = first; i < last; ++i) {
    if (stands(i)) batch_.restore(i, column(i));
  }
}

void Flights::step(std::span<const double> actions,
                   std::span<const std::uint8_t> moves,
                   const Executor& executor) {
  const bool by_rotor = options_.level == FlightLevel::kRotorSpeeds;
  const std::size_t numbers = by_rotor ? vehicle().rotors.size() : 4;
  require_argument(actions.size() == size() * numbers, "Flights::step: a row for each vehicle");
  require_argument(moves.empty() || moves.size() == size(), "Flights::step: moves for each");
  const std::size_t groups = (size() + kGroup - 1) / kGroup;
  executor.parallel_for(groups, kGroupsAtOnce, [&](std::size_t from, std::size_t until) {
    for (std::size_t group = from; group < until; ++group) {
      fly_group(group * kGroup, actions, moves);
    }
  });
}

std::vector<Body> Flights::bodies_around(std::uint32_t vehicle) const {
  const std::size_t first = vehicle / options_.team * options_.team;
  return traffic_->bodies(std::span(poses_).subspan(first, options_.team),
                          vehicle - first,
                          static_cast<double>(pattern_.range_max()));
}

void Flights::measure(std::span<const std::uint32_t> vehicles,
                      std::span<float> ranges,
                      const Executor& executor) const {
  require_argument(ranges.size() == size() * beams(), "Flights::measure: a row for each vehicle");
  for (const std::uint32_t i : vehicles) {
    require_argument(i < size(), "Flights::measure: numbers of vehicles");
  }
  RangePattern::BodiesOf bodies;
  if (traffic_) bodies = [this](std::uint32_t vehicle) { return bodies_around(vehicle); };
  const auto draws = [this](std::uint32_t vehicle) { return watch_[vehicle].draws; };
  pattern_.measure(*renderer_, poses_, vehicles, ranges, executor, bodies, draws);
}

std::vector<Vector3d> Flights::free_positions(const Aabb& box,
                                              double clearance,
                                              std::pair<double, double> heights,
                                              std::size_t wanted,
                                              std::uint64_t seed) const {
  const RandomStream random(seed, StreamId::kLearning, 0);
  const Vector3d size = box.size();
  std::vector<Vector3d> positions;
  std::uint64_t draw = 0;
  const std::uint64_t most = 4 * kMostTries * wanted;
  while (positions.size() < wanted && draw < most) {
    const double x = box.min.x() + random.uniform(draw) * size.x();
    const double y = box.min.y() + random.uniform(draw + 1) * size.y();
    const double z = box.min.z() + random.uniform(draw + 2) * size.z();
    const double height =
        heights.first + random.uniform(draw + 3) * (heights.second - heights.first);
    draw += 4;
    const Ray down{Vector3d(x, y, z), -Vector3f::UnitZ(), static_cast<float>(size.z() + 1.0)};
    const Hit ground = renderer_->trace(down);
    if (!ground.is_return()) continue;
    const Vector3d position(x, y, z - static_cast<double>(ground.range) + height);
    if (position.z() > box.max.z() || map_->nearest(position, clearance)) continue;
    positions.push_back(position);
  }
  return positions;
}

}  // namespace pointflight
