#pragma once

#include <span>

#include "pointflight/sim/fleet.hpp"
#include "pointflight/sim/sensor_costs.hpp"
#include "pointflight/world/obstacles.hpp"

namespace pointflight {

/// Takes what the interval sensors of vehicles that fly here have come to the end of by `now`: in
/// arrears, from the recorded tracks of all bodies. Measurements that end together are taken
/// together and reach the sink in the order of vehicles and sensors; `costs` are charged.
void sense_intervals(const Fleet& fleet,
                     const Obstacles& obstacles,
                     SimTime now,
                     std::span<VehicleStatus> statuses,
                     SensorCosts& costs,
                     SampleSink& sink,
                     const Executor& executor);

}  // namespace pointflight
