#include "pointflight/flight_log/internal/flown_samples.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "pointflight/core/input_error.hpp"
#include "pointflight/vehicle/motor_outputs.hpp"

namespace pointflight::flight_log {
namespace {

constexpr double kLongestGap = 0.1;  // s between samples of one stretch
constexpr double kSettling = 0.25;   // s until the rotors are where their outputs put them
constexpr double kOffGround = 0.5;   // m
constexpr double kIdleShare = 0.5;   // of the hover output: below it stands or falls

/// True if all motors turn, and not only idle.
bool carries(const LoggedOutputs& outputs, std::size_t rotors, double hover) {
  if (outputs.outputs.size() < rotors) return false;
  double sum = 0.0;
  for (std::size_t i = 0; i < rotors; ++i) {
    if (!std::isfinite(outputs.outputs[i])) return false;
    sum += static_cast<double>(outputs.outputs[i]);
  }
  return sum > kIdleShare * hover * static_cast<double>(rotors);
}

/// Height of the ground that it left, m; minus infinity if it flew when the log began.
double left_ground(const FlightLog& log, std::size_t rotors, double hover) {
  if (carries(log.outputs.front(), rotors, hover)) return -std::numeric_limits<double>::infinity();
  for (const LoggedOutputs& outputs : log.outputs) {
    if (carries(outputs, rotors, hover)) return log.state_at(outputs.time).p_world.z();
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

void require_outputs(const FlightLog& log, const VehicleSettings& vehicle) {
  const std::size_t outputs = log.outputs.front().outputs.size();
  if (outputs >= vehicle.rotors.size()) return;
  throw InputError(
      fmt::format("{}: {} has {} outputs, the vehicle {} rotors: give a vehicle of its kind",
                  log.path,
                  log.outputs_from,
                  outputs,
                  vehicle.rotors.size()));
}

std::vector<FlownSample> flown_samples(const FlightLog& log,
                                       const VehicleSettings& vehicle,
                                       double from,
                                       double until) {
  const std::size_t rotors = vehicle.rotors.size();
  const double hover = MotorOutputs(vehicle).hover();
  const double ground = left_ground(log, rotors, hover);
  from = std::max(
      {from, log.outputs.front().time, log.attitude.front().time, log.motion.front().time});
  until =
      std::min({until, log.outputs.back().time, log.attitude.back().time, log.motion.back().time});
  std::vector<FlownSample> samples;
  std::size_t next_output = 0;
  std::size_t stretch = 0;
  double last_time = -kLongestGap;
  double began = 0.0;
  bool was_flying = false;
  for (const LoggedImu& imu : log.imu) {
    if (imu.time < from || imu.time > until) continue;
    std::vector<HeldOutputs> since;
    if (next_output > 0) since.push_back({last_time, &log.outputs[next_output - 1]});
    while (next_output < log.outputs.size() && log.outputs[next_output].time < imu.time) {
      since.push_back({log.outputs[next_output].time, &log.outputs[next_output]});
      ++next_output;
    }
    const bool is_gap = imu.time - last_time > kLongestGap;
    last_time = imu.time;
    if (since.empty()) continue;
    FlownSample sample{imu.time, log.state_at(imu.time), imu.accel, 0, false, std::move(since)};
    sample.state.omega_body = imu.gyro;
    const bool is_flying = carries(*sample.since.back().given, rotors, hover) &&
                           sample.state.p_world.z() > ground + kOffGround;
    if (is_flying && (is_gap || !was_flying)) {
      ++stretch;
      began = imu.time;
    }
    was_flying = is_flying;
    if (!is_flying) continue;
    sample.stretch = stretch;
    sample.is_settling = imu.time - began < kSettling;
    samples.push_back(std::move(sample));
  }
  return samples;
}

}  // namespace pointflight::flight_log
