#pragma once

#include <string>
#include <vector>

#include "pointflight/core/owned_files.hpp"
#include "pointflight/sim/scenario.hpp"

namespace pointflight {

/// Writes a scenario as it is flown, with all that it takes from other files, so that it can be
/// flown again from that folder alone: scenario.yaml; inputs/ with copies of sensors, vehicles,
/// profiles, obstacles' clouds, keyframes and trajectories that are given by path; and, under its
/// own name, a link to the map, unless that is of a made-up world. The scenario then demands the
/// map's hash.
///
/// `final_folder`: if the folder's files will lie in the end; the link is relative to it. The
/// text depends on the scenario and its files, not on where they or the folder lie. Throws
/// InputError.
void write_scenario_copy(const Scenario& scenario,
                         const std::string& map_hash,
                         OutputFolder& folder,
                         const std::string& final_folder);

/// Paths of the files that a scenario names: sensors, vehicles and profiles that are given by path,
/// obstacles' clouds, keyframes, trajectories; not of the map, nor of tables that sensors name.
std::vector<std::string> files_of(const Scenario& scenario);

}  // namespace pointflight
