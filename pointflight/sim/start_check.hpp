#pragma once

#include <span>
#include <vector>

#include "pointflight/sim/scenario.hpp"
#include "pointflight/sim/vehicle_agent.hpp"

namespace pointflight {

/// Names make folders and topics: each its own, and nothing but plain letters. Throws InputError.
void check_names(const Scenario& scenario, const std::vector<VehicleSetup>& fleet);

/// A vehicle where it starts.
struct StartingVehicle {
  const VehicleAgent* agent = nullptr;
  Pose T_world_body;
};

/// Throws InputError where a vehicle starts inside the map, another vehicle or an obstacle (which
/// stand where they are at time zero).
void check_start_is_free(const Scenario& scenario,
                         const SurfelMap& map,
                         const StartingVehicle& vehicle,
                         std::span<const StartingVehicle> others,
                         std::span<const Body> obstacles);

}  // namespace pointflight
