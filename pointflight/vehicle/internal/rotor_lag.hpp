#pragma once

#include "pointflight/vehicle/airframe.hpp"

namespace pointflight {

/// Of x'' = -wn^2 x - 2 z wn x' over some time t: x(t) = decay (x0 c + (x0' + z wn x0) s).
struct RotorLag {
  double decay = 1.0;
  double c = 1.0;
  double s = 0.0;
};

/// What all steps of one length have in common.
struct StepLag {
  double dt = 0.0;       ///< s
  RotorLag half, whole;  ///< Of the rotors until its middle and its end.
};

/// By the kind of damping, in closed form: exact at any `dt`.
StepLag step_lag(const RotorModel& rotor, double dt);

}  // namespace pointflight
