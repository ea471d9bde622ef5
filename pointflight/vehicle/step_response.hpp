#pragma once

#include <string>
#include <vector>

#include "pointflight/vehicle/airframe.hpp"

namespace pointflight {

/// How a loop of a vehicle answers a step, flown by the simulation itself.
struct StepResponse {
  std::string name;           ///< "position x", "attitude roll", ...
  std::string unit;           ///< Of the step.
  double size = 1.0;          ///< Of the step.
  LoopDesign design;          ///< What the loop was designed for.
  bool first_order = false;   ///< The design is a first-order lag of that frequency.
  double step = 0.001;        ///< s between samples
  std::vector<double> value;  ///< Response by size: 0 at first, about 1 in the end.

  double rise_time = 0.0;  ///< From 10 to 90 %, s.
  double overshoot = 0.0;  ///< Share of the step.
  double settling = 0.0;   ///< Last time outside 5 %, s.
  double bandwidth = 0.0;  ///< Where the closed loop's gain falls below 1 / sqrt(2), rad/s.
};

/// Steps at each command level from hover: body rates, attitude, velocity, position, height, yaw.
std::vector<StepResponse> step_responses(const VehicleSettings& settings);

/// The figures of a response whose `value` and `step` are given.
void measure(StepResponse& response);

/// Response of the design by itself, at the same instants.
std::vector<double> designed_response(const StepResponse& response);

}  // namespace pointflight
