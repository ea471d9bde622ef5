#pragma once

#include <string>

#include "pointflight/run/run_loop.hpp"
#include "pointflight/sim/simulation.hpp"

namespace pointflight::apps {

/// How a flight's result is said.
struct FlightReport {
  std::string input;   ///< What was flown.
  std::string output;  ///< Folder of its files; empty: none.
  bool has_picture = true;
  bool json = false;
};

/// To stdout: how a flight ended, how each vehicle fared and what it cost.
void print_result(const FlightReport& report, const Simulation& simulation, const RunLoop& loop);

}  // namespace pointflight::apps
