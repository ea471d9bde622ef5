// Between what a simulation says and what goes over the network.
#pragma once

#include <cstdint>

#include "pointflight/share/messages.hpp"
#include "pointflight/share/shared_step.hpp"

namespace pointflight {

/// An instant of the run, from and to ns since its start.
///@{
inline SimTime to_time(std::int64_t ns) {
  return SimTime(Duration(ns));
}
inline std::int64_t to_ns(SimTime time) {
  return time.time_since_epoch().count();
}
///@}

/// ns, of clocks and waits.
inline constexpr std::int64_t kMillisecond = 1'000'000;

/// A message as it is sent.
template <class M>
Bytes bytes_of(const M& message) {
  return std::make_shared<const std::vector<std::byte>>(encode<Wire::kCdr>(message));
}

/// What others are told of a vehicle.
share_msg::VehicleState state_of(const SharedVehicle& vehicle);
/// The body in what was told: exactly the bits that were sent.
RigidBodyState body_of(const share_msg::VehicleState& state);
/// A vehicle with its body, which may be another than was told, and the flags that were.
SharedVehicle vehicle_of(std::uint32_t number, std::uint32_t flags, const RigidBodyState& body);

/// Figures that a vehicle can have.
bool is_plausible(const RigidBodyState& body);

}  // namespace pointflight
