#pragma once

#include <span>
#include <string>
#include <vector>

#include "pointflight/sim/scenario.hpp"
#include "pointflight/sim/vehicle_agent.hpp"

namespace pointflight {

class Renderer;
class Simulation;

/// Names make folders and topics: each its own, and nothing but plain letters. Throws InputError.
void check_names(const Scenario& scenario, const std::vector<VehicleSetup>& fleet);

/// For programs that step a simulation themselves, where no firmware can connect. Throws InputError
/// if the scenario has one fly a vehicle.
void require_own_autopilots(const Scenario& scenario);

/// Copies stay where numbers in files are taken, too. Throws InputError.
void check_reach(const Scenario& scenario, const std::vector<VehicleSetup>& fleet);

/// A vehicle where it starts.
struct StartingVehicle {
  const VehicleAgent* agent = nullptr;  ///< Never null if it is checked.
  Pose T_world_body;                    ///< Its pose at time zero.
};

/// True for positions so far outside of the map's bounds that nobody means to be there: 50 m beside
/// or below, 500 m above. A run ends there.
bool is_lost(const SurfelMap& map, const Vector3d& p_world);

/// Throws InputError if a vehicle starts inside the map, another vehicle or an obstacle (which
/// stand where they are at time zero), or lost.
void check_start_is_free(const Scenario& scenario,
                         const SurfelMap& map,
                         const StartingVehicle& vehicle,
                         std::span<const StartingVehicle> others,
                         std::span<const Body> obstacles,
                         const Executor& executor);

/// True if the map is above a position and nothing of it below: that is below the floor, or there
/// is no ground.
bool is_below_floor(const Renderer& renderer, const Vector3d& p_world);

/// Where a vehicle stands that starts on the ground: on what lies below `p_world`, its hull just
/// above it; `p_world` itself if nothing does.
Vector3d standing_below(const Renderer& renderer, const Solid& hull, const Vector3d& p_world);

/// What is odd about where vehicles start, in words for the user with file and line: below the
/// floor, or landed if there is no ground.
std::vector<std::string> start_warnings(const Simulation& simulation, const Executor& executor);

}  // namespace pointflight
