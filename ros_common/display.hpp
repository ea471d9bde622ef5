// What people look at: vehicles as markers, their state in words.
#pragma once

#include <span>
#include <string>

#include "pointflight/sim/simulation.hpp"
#include "ros_common/messages.hpp"
#include "ros_common/outputs.hpp"

namespace pointflight {

/// A vehicle in one of its shapes: hull (kModel), velocity, trajectory (of `flown`), covariance,
/// LiDAR (kSensorModel), name (kLabel).
msg::Marker vehicle_marker(OutputKind kind,
                           const VehicleAgent& agent,
                           const RigidBodyState& state,
                           const msg::Header& header,
                           const std::string& ns,
                           std::span<const msg::PoseStamped> flown);

/// What each vehicle does, what it met, what was refused; `refused` messages were left out before a
/// vehicle saw them.
msg::DiagnosticArray diagnostics_of(const Simulation& simulation,
                                    SimTime time,
                                    const msg::Header& header,
                                    std::uint64_t refused,
                                    const std::string& last_refused);

}  // namespace pointflight
