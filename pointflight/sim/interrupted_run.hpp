#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/sim/simulation.hpp"

namespace pointflight {

/// Beside the trajectories of a shared run while it is written: how much of its time was jumped
/// over so far, ns.
inline constexpr const char* kSkippedFile = "skipped.txt";

/// The last states logged by a process of a shared run that was killed, from which it can resume.
struct InterruptedRun {
  Scenario scenario;                           ///< As it was flown.
  SimTime time;                                ///< Of the states.
  Duration skipped{0};                         ///< Of it, jumped over.
  std::map<std::size_t, VehicleState> states;  ///< By number.
};
/// The latest instant that all of these vehicles (by number) have in what such a run left in
/// `folder`; nothing if it left nothing of the kind.
std::optional<InterruptedRun> ended_run(const std::string& folder,
                                        const Simulation& simulation,
                                        const std::vector<std::size_t>& vehicles);

}  // namespace pointflight
