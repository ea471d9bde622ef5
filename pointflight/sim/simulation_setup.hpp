#pragma once

#include <memory>
#include <vector>

#include "pointflight/sim/simulation.hpp"

namespace pointflight {

/// What does not change in a run; copies of a simulation share it.
struct Simulation::Setup {
  Scenario scenario;
  std::shared_ptr<const SurfelMap> map;
  std::vector<std::unique_ptr<VehicleAgent>> agents;
  Obstacles obstacles;
  Duration step{0};
  SimTime end_time;
  Schedule obstacle_schedule{10.0};
};

}  // namespace pointflight
