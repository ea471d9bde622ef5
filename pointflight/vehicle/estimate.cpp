#include "pointflight/vehicle/estimate.hpp"

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

constexpr std::uint64_t kDraws = 9;  // of two numbers each, for a report

double squared(double x) {
  return x * x;
}

}  // namespace

bool EstimateSettings::is_true() const {
  EstimateSettings late;
  late.latency = latency;
  late.dropout = dropout;
  late.position_limit = position_limit;  // of nothing
  late.yaw_limit_deg = yaw_limit_deg;
  return *this == late;
}

void describe(SettingsVisitor& v, EstimateSettings& s) {
  v.value({"position_walk", "m/sqrt(s)", "drift of each coordinate", 0, 10}, s.position_walk);
  v.value({"position_limit", "m", "deviation at which that stays; 0: it goes on", 0, 1e4},
          s.position_limit);
  v.value({"yaw_walk_deg", "deg/sqrt(s)", "drift of the heading", 0, 90}, s.yaw_walk_deg);
  v.value({"yaw_limit_deg", "deg", "deviation at which that stays; 0: it goes on", 0, 180},
          s.yaw_limit_deg);
  v.value({"position_noise", "m", "white, of each coordinate", 0, 100}, s.position_noise);
  v.value({"yaw_noise_deg", "deg", "white", 0, 90}, s.yaw_noise_deg);
  v.value({"tilt_noise_deg", "deg", "white, of roll and of pitch", 0, 45}, s.tilt_noise_deg);
  v.value({"velocity_noise", "m/s", "white, of each component", 0, 100}, s.velocity_noise);
  v.value({"latency", "s", "from a state to its report", 0, 10}, s.latency);
  v.value({"dropout", "", "share of reports that are lost", 0, 0.999}, s.dropout);
}

RigidBodyState EstimateError::on(const RigidBodyState& truth) const {
  RigidBodyState believed = truth;
  const Quaterniond turn = quaternion_from_rpy(0.0, 0.0, yaw);
  const Quaterniond tilt(
      1.0, 0.5 * rotation_body.x(), 0.5 * rotation_body.y(), 0.5 * rotation_body.z());
  believed.p_world += p_world;
  believed.q_world_body = (turn * truth.q_world_body * tilt).normalized();
  believed.v_world = turn * truth.v_world + v_world;
  return believed;
}

Estimator::Estimator(const EstimateSettings& settings,
                     double rate,
                     std::uint64_t seed,
                     std::uint32_t number)
    : settings_(settings), rate_(rate), random_(seed, StreamId::kOdometry, number) {}

Estimator::Step Estimator::step_of(double walk, double limit, double dt) const {
  if (limit <= 0.0) return {1.0, walk * walk * dt};
  const double keep = math::exp(-0.5 * dt * squared(walk / limit));
  return {keep, limit * limit * (1.0 - keep * keep)};
}

EstimateError Estimator::error(std::int64_t index, Memory& memory) const {
  const EstimateSettings& s = settings_;
  const std::uint64_t first = kDraws * static_cast<std::uint64_t>(index);
  const auto normals = [&](std::uint64_t draw) { return random_.normal2(first + draw); };
  const auto three = [&](std::uint64_t draw) {
    const auto a = normals(draw);
    return Vector3d(a[0], a[1], normals(draw + 1)[0]);
  };
  if (memory.index >= 0) {
    const double dt = static_cast<double>(index - memory.index) / rate_;
    const Step place = step_of(s.position_walk, s.position_limit, dt);
    const Step heading = step_of(s.yaw_walk_deg * kDegree, s.yaw_limit_deg * kDegree, dt);
    memory.position = place.keep * memory.position + std::sqrt(place.added) * three(0);
    memory.yaw = heading.keep * memory.yaw + std::sqrt(heading.added) * normals(2)[0];
    memory.position_variance = squared(place.keep) * memory.position_variance + place.added;
    memory.yaw_variance = squared(heading.keep) * memory.yaw_variance + heading.added;
  }
  memory.index = index;
  EstimateError error;
  error.p_world = memory.position + s.position_noise * three(3);
  error.yaw = memory.yaw + s.yaw_noise_deg * kDegree * normals(2)[1];
  error.v_world = s.velocity_noise * three(5);
  const auto tilt = normals(7);
  error.rotation_body = s.tilt_noise_deg * kDegree * Vector3d(tilt[0], tilt[1], 0.0);
  return error;
}

EstimateVariance Estimator::variance(const Memory& memory) const {
  EstimateVariance v;
  v.position = memory.position_variance + squared(settings_.position_noise);
  v.velocity = squared(settings_.velocity_noise);
  v.tilt = squared(settings_.tilt_noise_deg * kDegree);
  v.yaw = memory.yaw_variance + squared(settings_.yaw_noise_deg * kDegree);
  return v;
}

bool Estimator::loses(std::int64_t index) const {
  if (settings_.dropout <= 0.0) return false;
  return random_.uniform(kDraws * static_cast<std::uint64_t>(index) + 8) < settings_.dropout;
}

}  // namespace pointflight
