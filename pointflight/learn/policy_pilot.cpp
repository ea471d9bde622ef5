#include "pointflight/learn/policy_pilot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

/// Of its period: a scan that comes a little early is acted upon.
constexpr double kDue = 0.9;
/// Times the straight way at full speed: so long a goal may take.
constexpr double kSlowly = 3.0;

}  // namespace

PolicyPilot::PolicyPilot(std::shared_ptr<const Policy> policy,
                         std::size_t vehicle,
                         std::vector<Vector3d> goals_world)
    : policy_(std::move(policy)),
      vehicle_(vehicle),
      goals_(std::move(goals_world)),
      rests_(goals_.empty()) {}

void PolicyPilot::open(const RunDescription& run) {
  const VehicleDescription& vehicle = run.vehicles.at(vehicle_);
  if (!policy_->settings().image) return;
  if (vehicle.lidars.empty()) {
    throw InputError(fmt::format("{}: flies by ranges, and vehicle {} has no LiDAR",
                                 policy_->settings().path,
                                 vehicle.setup.name));
  }
  T_body_sensor_ = vehicle.lidars.front().T_body_sensor;
}

void PolicyPilot::on_sample(const Sample& sample) {
  if (const auto* odometry = std::get_if<OdometrySample>(&sample)) {
    if (odometry->vehicle == vehicle_) on_odometry(*odometry);
  } else if (const auto* scanned = std::get_if<ScanSample>(&sample)) {
    if (wants_answer(sample)) on_scan(*scanned->scan);
  }
}

bool PolicyPilot::wants_answer(const Sample& sample) const {
  const auto* scanned = std::get_if<ScanSample>(&sample);
  return scanned != nullptr && scanned->scan->vehicle == vehicle_ && scanned->scan->sensor == 0 &&
         policy_->settings().image && !rests_;
}

void PolicyPilot::begin_way(const Vector3d& from_world, SimTime now) {
  const PolicySettings& settings = policy_->settings();
  since_ = now;
  time_limit_ = settings.time_limit;
  if (settings.speed <= 0.0) return;
  const double straight = (goals_[next_] - from_world).norm() / settings.speed;
  time_limit_ = std::max(time_limit_, kSlowly * straight);
}

void PolicyPilot::rest() {
  rests_ = true;
  orders_.emplace_back(VehicleOrder{vehicle_, HoverCommand{}, true});
}

void PolicyPilot::on_odometry(const OdometrySample& odometry) {
  odometry_ = odometry;
  if (rests_) return;
  const Vector3d& at = odometry.state.p_world;
  const SimTime now = odometry.delivered;
  if (time_limit_ == 0.0) begin_way(at, now);
  if (policy_->settings().task != "hover" && (at - goals_[next_]).norm() < kRadius) {
    if (++next_ == goals_.size()) return rest();
    begin_way(at, now);
  }
  if (to_seconds(now - since_) > time_limit_) return rest();
  if (!policy_->settings().image) act({}, now);
}

void PolicyPilot::on_scan(const Scan& scan) {
  if (odometry_ && time_limit_ > 0.0) act(policy_->image_of(points_now(scan)), scan.end);
}

/// In the body frame as the odometry has it: at its time, by constant velocities.
std::vector<Vector3d> PolicyPilot::points_now(const Scan& scan) const {
  const RigidBodyState& body = odometry_->state;
  const Vector3d v_body = body.q_world_body.conjugate() * body.v_world;
  std::vector<Vector3d> points;
  points.reserve(scan.points.size());
  for (const ScanPoint& point : scan.points) {
    const double age = to_seconds(odometry_->time - scan.seen_at(point));
    const Vector3d measured = T_body_sensor_ * point.position_sensor.cast<double>();
    const Vector3d turn = -age * body.omega_body;
    points.emplace_back(quaternion_from_rotation_vector(turn) * measured - age * v_body);
  }
  return points;
}

void PolicyPilot::act(std::span<const float> image, SimTime now) {
  const PolicySettings& settings = policy_->settings();
  if (last_act_ && to_seconds(now - *last_act_) < kDue * settings.action_period) return;
  last_act_ = now;
  target_.goal_world = goals_[next_];
  target_.elapsed = to_seconds(now - since_);
  const auto action = policy_->act(image, odometry_->state, target_);
  target_.last_action = action;
  VelocityCommand command;
  command.v_world = settings.speed * Vector3d(static_cast<double>(action[0]),
                                              static_cast<double>(action[1]),
                                              static_cast<double>(action[2]));
  command.yaw_rate = settings.yaw_rate * static_cast<double>(action[3]);
  command.turn = true;
  command.in_body = true;
  orders_.emplace_back(VehicleOrder{vehicle_, command, true});
}

std::vector<Order> PolicyPilot::take_orders() {
  return std::exchange(orders_, {});
}

void PolicyPilot::on_reset(SimTime /*reached*/) {
  odometry_.reset();
  last_act_.reset();
  next_ = 0;
  rests_ = goals_.empty();
  time_limit_ = 0.0;
  target_ = {};
  orders_.clear();
}

}  // namespace pointflight
