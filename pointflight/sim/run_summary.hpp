#pragma once

#include <string>

#include "pointflight/sim/simulation.hpp"

namespace pointflight {

/// summary.json as text: what happened, without wall-clock figures.
std::string summary_json(const Simulation& simulation);

}  // namespace pointflight
