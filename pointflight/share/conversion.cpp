#include "pointflight/share/conversion.hpp"

#include <cmath>

namespace pointflight {
namespace {

// what a vehicle never exceeds
constexpr double kPlaceMost = 1e7;  // m
constexpr double kSpeedMost = 1e4;  // m/s, rad/s

}  // namespace

share_msg::VehicleState state_of(const SharedVehicle& vehicle) {
  using State = share_msg::VehicleState;
  const RigidBodyState& b = vehicle.body;
  const Quaterniond& q = b.q_world_body;
  State state;
  state.number = vehicle.number;
  state.flags = (vehicle.crashed ? State::CRASHED : 0u) | (vehicle.arrived ? State::ARRIVED : 0u) |
                (vehicle.commanded ? State::COMMANDED : 0u);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    state.position[i] = b.p_world[k];
    state.velocity[i] = b.v_world[k];
    state.body_rate[i] = b.omega_body[k];
  }
  state.orientation = {q.w(), q.x(), q.y(), q.z()};
  return state;
}

RigidBodyState body_of(const share_msg::VehicleState& s) {
  RigidBodyState body;
  body.p_world = Vector3d(s.position.data());
  body.v_world = Vector3d(s.velocity.data());
  body.omega_body = Vector3d(s.body_rate.data());
  body.q_world_body =
      Quaterniond(s.orientation[0], s.orientation[1], s.orientation[2], s.orientation[3]);
  return body;
}

SharedVehicle vehicle_of(std::uint32_t number, std::uint32_t flags, const RigidBodyState& body) {
  using State = share_msg::VehicleState;
  SharedVehicle vehicle;
  vehicle.number = number;
  vehicle.body = body;
  vehicle.crashed = (flags & State::CRASHED) != 0;
  vehicle.arrived = (flags & State::ARRIVED) != 0;
  vehicle.commanded = (flags & State::COMMANDED) != 0;
  return vehicle;
}

bool is_plausible(const RigidBodyState& body) {
  return body.is_finite() && body.p_world.cwiseAbs().maxCoeff() < kPlaceMost &&
         body.v_world.norm() < kSpeedMost && body.omega_body.norm() < kSpeedMost &&
         std::abs(body.q_world_body.norm() - 1.0) < 1e-3;
}

}  // namespace pointflight
