#include "pointflight/sitl/ardupilot_parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pointflight/core/input_error.hpp"
#include "pointflight/vehicle/motor_outputs.hpp"

namespace pointflight {
namespace {

/// Torques (roll, pitch, yaw, N m) of a unit of ArduPilot's outputs.
Vector3d torque_of_output(const VehicleSettings& vehicle) {
  constexpr double kFactor = 0.5;  // AP_MotorsMatrix::normalise_rpy_factors
  const double thrust_max =
      vehicle.rotor.thrust_coefficient * vehicle.rotor.speed_max * vehicle.rotor.speed_max;
  const double ratio = vehicle.rotor.torque_coefficient / vehicle.rotor.thrust_coefficient;
  Vector3d torque = Vector3d::Zero();
  for (const RotorPlacement& rotor : vehicle.rotors) {
    torque += kFactor * thrust_max *
              Vector3d(std::abs(rotor.position.y()), std::abs(rotor.position.x()), ratio);
  }
  return torque;
}

}  // namespace

std::vector<std::pair<std::string, double>> ardupilot_parameters(const VehicleSettings& vehicle) {
  const MotorOutputs motors(vehicle);
  if (!motors.is_x_quad()) {
    throw InputError(
        fmt::format("{}: ArduPilot's parameters are for quadrotors with a rotor in each quarter",
                    vehicle.path));
  }
  struct Axis {
    const char* name;
    double integral, derivative;  // shares of the proportional gain, as ArduCopter's defaults
  };
  constexpr std::array<Axis, 3> kAxes = {
      {{"RLL", 1.0, 0.027}, {"PIT", 1.0, 0.027}, {"YAW", 0.1, 0.0}}};
  const double u = motors.hover();
  const double f = motors.square_share();
  std::vector<std::pair<std::string, double>> all = {
      {"FRAME_CLASS", 1},
      {"FRAME_TYPE", 1},
      {"SIM_RATE_HZ", 1000},
      {"MOT_PWM_MIN", 1000},
      {"MOT_PWM_MAX", 2000},
      // outputs go straight from the rotors' least speed to the greatest
      {"MOT_SPIN_ARM", 0.01},
      {"MOT_SPIN_MIN", 0.02},
      {"MOT_SPIN_MAX", 1.0},
      {"MOT_THST_EXPO", f},
      {"MOT_THST_HOVER", std::clamp(f * u * u + (1.0 - f) * u, 0.125, 0.6875)},
      {"ANGLE_MAX", 100.0 * std::clamp(vehicle.controller.tilt_max_deg, 10.0, 80.0)},
  };
  for (int i = 1; i <= 4; ++i) all.emplace_back(fmt::format("SERVO{}_FUNCTION", i), 32 + i);
  const Vector3d torque = torque_of_output(vehicle);
  for (std::size_t i = 0; i < kAxes.size(); ++i) {
    const Axis& axis = kAxes[i];
    const auto row = static_cast<Eigen::Index>(i);
    const LoopDesign& loop = i < 2 ? vehicle.controller.roll_pitch : vehicle.controller.yaw;
    const double p =
        2.0 * loop.damping * loop.natural_frequency * vehicle.inertia_diagonal[row] / torque[row];
    all.emplace_back(fmt::format("ATC_ANG_{}_P", axis.name),
                     std::clamp(loop.natural_frequency / (2.0 * loop.damping), 1.0, 12.0));
    all.emplace_back(fmt::format("ATC_RAT_{}_P", axis.name), p);
    all.emplace_back(fmt::format("ATC_RAT_{}_I", axis.name), axis.integral * p);
    all.emplace_back(fmt::format("ATC_RAT_{}_D", axis.name), axis.derivative * p);
  }
  return all;
}

std::string ardupilot_parameter_file(const VehicleSettings& vehicle) {
  std::string text = fmt::format(
      "# {}: parameters of ArduCopter, made by `pointflight vehicle ardupilot-params`\n",
      vehicle.title);
  for (const auto& [name, value] : ardupilot_parameters(vehicle)) {
    text += fmt::format("{} {:.7g}\n", name, value);
  }
  return text;
}

}  // namespace pointflight
