#include "pointflight/vehicle/step_response.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/vehicle/controllers/loops.hpp"
#include "pointflight/vehicle/multirotor.hpp"

namespace pointflight {
namespace {

/// What is stepped, how it is read, how long it takes.
struct Trial {
  const char* name;
  const char* unit;
  double size;
  LoopDesign design;
  bool first_order;
  std::function<Setpoint(double value)> command;
  std::function<double(const RigidBodyState& state)> read;
};

double roll_of(const RigidBodyState& s) {
  return rotation_vector(s.q_world_body).x();
}

PositionCommand place(double x, double z, double yaw) {
  PositionCommand command;
  command.p_world = {x, 0.0, z};
  command.yaw = yaw;
  return command;
}

/// Of the attitude.
std::vector<Trial> inner_trials(const VehicleSettings& v) {
  const ControllerSettings& c = v.controller;
  const double weight = v.mass * kGravity;
  LoopDesign rate = c.roll_pitch;
  rate.natural_frequency = 2.0 * rate.damping * rate.natural_frequency;
  const auto roll_rate = [=](double x) { return BodyRateCommand{{x, 0, 0}, weight}; };
  const auto roll = [=](double x) {
    return AttitudeCommand{quaternion_from_rpy(x, 0, 0), weight, Vector3d::Zero()};
  };
  const auto yaw = [](double x) { return place(0.0, 0.0, x); };
  return {
      {"roll rate",
       "rad/s",
       0.2,
       rate,
       true,
       roll_rate,
       [](const RigidBodyState& s) { return s.omega_body.x(); }},
      {"roll attitude", "rad", 0.1, c.roll_pitch, false, roll, roll_of},
      {"yaw",
       "rad",
       0.1,
       c.yaw,
       false,
       yaw,
       [](const RigidBodyState& s) { return yaw_of(s.q_world_body); }},
  };
}

/// Of the position and its derivatives.
std::vector<Trial> outer_trials(const VehicleSettings& v) {
  const ControllerSettings& c = v.controller;
  LoopDesign velocity = c.horizontal;
  velocity.natural_frequency *= kVelocityToPosition;
  velocity.integral = 0.0;
  const auto accelerate = [](double x) { return AccelerationCommand{{x, 0, 0}, 0.0, 0.0}; };
  const auto go = [](double x) { return VelocityCommand{{x, 0, 0}, 0.0, 0.0}; };
  // what the tilt makes of the thrust; drag takes its part later
  const auto tilted = [](const RigidBodyState& s) {
    const Vector3d b3 = s.q_world_body * Vector3d::UnitZ();
    return kGravity * b3.x() / b3.z();
  };
  return {
      {"acceleration x", "m/s^2", 0.5, c.roll_pitch, false, accelerate, tilted},
      {"velocity x",
       "m/s",
       0.5,
       velocity,
       false,
       go,
       [](const RigidBodyState& s) { return s.v_world.x(); }},
      {"position x",
       "m",
       0.5,
       c.horizontal,
       false,
       [](double x) { return place(x, 0.0, 0.0); },
       [](const RigidBodyState& s) { return s.p_world.x(); }},
      {"position z",
       "m",
       0.5,
       c.vertical,
       false,
       [](double x) { return place(0.0, x, 0.0); },
       [](const RigidBodyState& s) { return s.p_world.z(); }},
  };
}

}  // namespace

void measure(StepResponse& r) {
  double t10 = -1.0;
  double t90 = -1.0;
  r.overshoot = 0.0;
  r.settling = 0.0;
  for (std::size_t i = 0; i < r.value.size(); ++i) {
    const double t = static_cast<double>(i) * r.step;
    if (t10 < 0.0 && r.value[i] > 0.1) t10 = t;
    if (t90 < 0.0 && r.value[i] > 0.9) t90 = t;
    r.overshoot = std::max(r.overshoot, r.value[i] - 1.0);
    if (std::abs(r.value[i] - 1.0) > 0.05) r.settling = t;
  }
  r.rise_time = t90 < 0.0 ? 0.0 : t90 - t10;
  // the transform of the response's derivative is the closed loop's gain
  const auto gain = [&](double w) {
    double re = 0.0;
    double im = 0.0;
    for (std::size_t i = 1; i < r.value.size(); ++i) {
      const double dy = r.value[i] - r.value[i - 1];
      const auto angle = math::sincos(w * (static_cast<double>(i) - 0.5) * r.step);
      re += dy * angle.cos;
      im -= dy * angle.sin;
    }
    return std::hypot(re, im);
  };
  double low = 0.0;
  double high = 0.05 * r.design.natural_frequency;
  const double limit = 1.0 / std::sqrt(2.0);
  while (gain(high) > limit && high < 20.0 * r.design.natural_frequency) {
    low = high;
    high *= 1.15;
  }
  for (int i = 0; i < 30; ++i) {
    const double middle = 0.5 * (low + high);
    (gain(middle) > limit ? low : high) = middle;
  }
  r.bandwidth = low;
}

std::vector<double> designed_response(const StepResponse& r) {
  const double wn = r.design.natural_frequency;
  const double z = r.design.damping;
  std::vector<double> value;
  double y = 0.0;
  double dy = 0.0;
  constexpr int kFine = 20;
  const double h = r.step / kFine;
  for (std::size_t i = 0; i < r.value.size(); ++i) {
    value.push_back(y);
    for (int k = 0; k < kFine; ++k) {
      if (r.first_order) {
        y += h * wn * (1.0 - y);
        continue;
      }
      dy += h * (wn * wn * (1.0 - y) - 2.0 * z * wn * dy);
      y += h * dy;
    }
  }
  return value;
}

std::vector<StepResponse> step_responses(const VehicleSettings& settings) {
  std::vector<StepResponse> responses;
  const Multirotor vehicle(settings);
  const auto controller = make_controller(settings.controller.kind, settings);
  std::vector<Trial> trials = inner_trials(settings);
  for (Trial& trial : outer_trials(settings)) trials.push_back(std::move(trial));
  for (const Trial& trial : trials) {
    StepResponse r;
    r.name = trial.name;
    r.unit = trial.unit;
    r.size = trial.size;
    r.design = trial.design;
    r.first_order = trial.first_order;
    VehicleState state = vehicle.hover_at(Vector3d::Zero(), 0.0);
    ControllerMemory memory;
    const double duration = 12.0 / trial.design.natural_frequency;
    for (double t = 0.0; t < duration; t += r.step) {
      r.value.push_back(trial.read(state.body) / trial.size);
      const auto speeds = controller->update(state.body, trial.command(trial.size), r.step, memory);
      vehicle.step(state, speeds, r.step);
    }
    measure(r);
    responses.push_back(std::move(r));
  }
  return responses;
}

}  // namespace pointflight
