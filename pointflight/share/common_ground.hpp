#pragma once

#include <optional>
#include <vector>

#include "pointflight/share/messages.hpp"
#include "pointflight/sim/simulation.hpp"

namespace pointflight {

/// What processes that share a run have to have in common, as name and value: program, map, seed,
/// rate, obstacles, vehicles with their models and LiDARs, the rest of the scenario.
/// Names and places of files do not matter, nor does what a process writes and how long it flies.
std::vector<share_msg::Part> common_ground(const Simulation& simulation, double rate);

/// True if a run of `earlier`, as its folder has it (`write_scenario_copy`), was one of this
/// simulation's scenario and map; models of the same name count as the same.
bool was_run_of(const Scenario& earlier, const Simulation& simulation);

/// True if two have the same names in the same order.
bool describes_alike(const std::vector<share_msg::Part>& theirs,
                     const std::vector<share_msg::Part>& ours);

/// How two that describe alike differ, in words: "another map (4f0c there, 77ab here)"; nothing
/// if they do not.
std::optional<std::string> difference(const std::vector<share_msg::Part>& theirs,
                                      const std::vector<share_msg::Part>& ours);

}  // namespace pointflight
