#include "pointflight/flight_log/log_comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/flight_log/internal/flown_samples.hpp"
#include "pointflight/vehicle/imu.hpp"
#include "pointflight/vehicle/motor_outputs.hpp"
#include "pointflight/vehicle/multirotor.hpp"

namespace pointflight {
namespace {

using flight_log::FlownSample;

constexpr double kFinestStep = 0.001;  // s

double angle_of_turn(const Quaterniond& q) {
  return 2.0 * math::atan2(q.vec().norm(), std::abs(q.w()));
}

/// What an ideal IMU on the vehicle measures, body axes.
LoggedImu ideal_imu(double time, const VehicleState& state, const Multirotor& multirotor) {
  const BodyAcceleration acceleration = multirotor.acceleration(state);
  const Vector3d& omega = state.body.omega_body;
  const Vector3d& arm = multirotor.settings().imu.position;
  return {time,
          omega,
          specific_force_body(state.body.q_world_body, acceleration.a_world) +
              acceleration.alpha_body.cross(arm) + omega.cross(omega.cross(arm))};
}

/// Flies over what was given to the motors since the sample before.
void fly_to(const FlownSample& sample,
            const Multirotor& multirotor,
            const MotorOutputs& motors,
            VehicleState& state) {
  for (std::size_t k = 0; k < sample.since.size(); ++k) {
    const double until = k + 1 < sample.since.size() ? sample.since[k + 1].from : sample.time;
    const double dt = until - sample.since[k].from;
    if (dt <= 0.0) continue;
    const auto speeds = motors.speeds(sample.since[k].given->outputs, true);
    const auto steps = static_cast<int>(std::ceil(dt / kFinestStep));
    for (int i = 0; i < steps; ++i) multirotor.step(state, speeds, dt / steps);
  }
}

ComparedSample compared(const FlownSample& sample,
                        double began,
                        const VehicleState& state,
                        const Multirotor& multirotor) {
  ComparedSample result;
  result.time = sample.time;
  result.in_window = sample.time - began;
  result.logged = {sample.time, sample.state.omega_body, sample.accel};
  result.flown = ideal_imu(sample.time, state, multirotor);
  const Vector3d up = sample.state.q_world_body * Vector3d::UnitZ();
  const Vector3d flown_up = state.body.q_world_body * Vector3d::UnitZ();
  result.tilt_error = math::atan2(up.cross(flown_up).norm(), up.dot(flown_up));
  result.turn_error =
      angle_of_turn(sample.state.q_world_body.conjugate() * state.body.q_world_body);
  result.speed_error = (state.body.v_world - sample.state.v_world).norm();
  return result;
}

void sum_up(LogComparison& result) {
  double ends = 0.0;
  for (std::size_t i = 0; i < result.samples.size(); ++i) {
    const ComparedSample& s = result.samples[i];
    result.accel_rms += (s.flown.accel - s.logged.accel).cwiseAbs2();
    result.gyro_rms += (s.flown.gyro - s.logged.gyro).cwiseAbs2();
    const bool is_end =
        i + 1 == result.samples.size() || result.samples[i + 1].in_window < s.in_window;
    if (!is_end) continue;
    ends += 1.0;
    result.tilt_rms += s.tilt_error * s.tilt_error;
    result.turn_rms += s.turn_error * s.turn_error;
    result.speed_rms += s.speed_error * s.speed_error;
  }
  const auto count = static_cast<double>(result.samples.size());
  result.accel_rms = (result.accel_rms / count).cwiseSqrt();
  result.gyro_rms = (result.gyro_rms / count).cwiseSqrt();
  result.tilt_rms = std::sqrt(result.tilt_rms / ends);
  result.turn_rms = std::sqrt(result.turn_rms / ends);
  result.speed_rms = std::sqrt(result.speed_rms / ends);
}

}  // namespace

LogComparison fly_outputs(const FlightLog& log,
                          const VehicleSettings& vehicle,
                          const LogComparisonOptions& options) {
  flight_log::require_outputs(log, vehicle);
  const auto samples = flight_log::flown_samples(log, vehicle, options.from, options.until);
  const Multirotor multirotor(vehicle);
  const MotorOutputs motors(vehicle);
  VehicleState state;
  state.rotors.resize(vehicle.rotors.size());
  LogComparison result;
  double began = 0.0;
  bool is_flying = false;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const FlownSample& sample = samples[i];
    if (i % 4096 == 0) {
      report(
          options.progress, "flying", static_cast<double>(i) / static_cast<double>(samples.size()));
    }
    const bool is_new = i == 0 || sample.stretch != samples[i - 1].stretch;
    if (is_new) {
      const auto speeds = motors.speeds(sample.since.back().given->outputs, true);
      for (std::size_t r = 0; r < speeds.size(); ++r) state.rotors[r] = {speeds[r], 0.0};
    } else {
      fly_to(sample, multirotor, motors, state);
    }
    // while they settle only the rotors are of interest
    if (is_new || sample.is_settling || !is_flying || sample.time - began > options.window) {
      if (!is_new && !sample.is_settling && is_flying) {
        result.samples.push_back(compared(sample, began, state, multirotor));
      }
      is_flying = !sample.is_settling;
      if (is_flying) ++result.windows;
      state.body = sample.state;
      began = sample.time;
      continue;
    }
    result.samples.push_back(compared(sample, began, state, multirotor));
  }
  if (result.samples.empty()) {
    throw InputError(fmt::format("{}: no flight of {:g} s, half a metre above the ground at least",
                                 log.path,
                                 options.window));
  }
  sum_up(result);
  return result;
}

FlownTime flown_time(const FlightLog& log, const VehicleSettings& vehicle) {
  flight_log::require_outputs(log, vehicle);
  const auto samples =
      flight_log::flown_samples(log, vehicle, 0.0, std::numeric_limits<double>::infinity());
  if (samples.empty()) {
    throw InputError(log.path + ": no flight, half a metre above the ground at least");
  }
  return {samples.front().time, samples.back().time};
}

}  // namespace pointflight
