#include "pointflight/sitl/px4_parameters.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/frames.hpp"
#include "pointflight/vehicle/motor_outputs.hpp"

namespace pointflight {
namespace {

constexpr double kGpsDelay = 120.0;  // ms, of the gnss that is mounted if there is none

/// Rotors in PX4's order and axes.
struct Px4Rotor {
  Vector3d position_frd;
  double moment_ratio = 0.0;  ///< m; positive: it turns counter-clockwise, seen from above.
};

std::vector<Px4Rotor> rotors_of(const VehicleSettings& vehicle) {
  const double ratio = vehicle.rotor.torque_coefficient / vehicle.rotor.thrust_coefficient;
  const MotorOutputs motors(vehicle);
  std::vector<Px4Rotor> rotors;
  for (const std::size_t number : motors.rotors()) {
    const RotorPlacement& rotor = vehicle.rotors[number];
    // its reaction is against its turn
    rotors.push_back({frd_from_flu(rotor.position), -rotor.yaw_sign * ratio});
  }
  return rotors;
}

/// Torques (roll, pitch, yaw, N m) that a unit of PX4's torque setpoint gives.
Vector3d torque_of_unit(const VehicleSettings& vehicle, const std::vector<Px4Rotor>& rotors) {
  const auto count = static_cast<Eigen::Index>(rotors.size());
  const double thrust_max =
      vehicle.rotor.thrust_coefficient * vehicle.rotor.speed_max * vehicle.rotor.speed_max;
  Eigen::MatrixXd effect(4, count);  // of a rotor's thrust on roll, pitch, yaw and thrust
  for (Eigen::Index i = 0; i < count; ++i) {
    const Px4Rotor& rotor = rotors[static_cast<std::size_t>(i)];
    effect.col(i) << -rotor.position_frd.y(), rotor.position_frd.x(), rotor.moment_ratio, 1.0;
  }
  const Eigen::MatrixXd mix = effect.completeOrthogonalDecomposition().pseudoInverse();
  Vector3d torque = Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    const double scale = mix.col(axis).norm() / std::sqrt(0.5 * static_cast<double>(count));
    if (scale > 0.0) torque[axis] = thrust_max * effect.row(axis).dot(mix.col(axis)) / scale;
  }
  if (torque.minCoeff() <= 1e-9) {
    throw InputError(fmt::format("{}: its rotors cannot turn it about each axis", vehicle.path));
  }
  return torque;
}

void add_loops(const VehicleSettings& vehicle,
               const std::vector<Px4Rotor>& rotors,
               std::vector<Px4Parameter>& all) {
  struct Axis {
    const char* name;
    double integral, derivative;     // shares of the proportional gain, as PX4's defaults
    double least, most, angle_most;  // that PX4 takes
  };
  constexpr std::array<Axis, 3> kAxes = {{{"ROLL", 1.33, 0.02, 0.01, 0.5, 12.0},
                                          {"PITCH", 1.33, 0.02, 0.01, 0.6, 12.0},
                                          {"YAW", 0.5, 0.0, 0.0, 0.6, 5.0}}};
  const Vector3d torque = torque_of_unit(vehicle, rotors);
  const ControllerSettings& c = vehicle.controller;
  for (std::size_t i = 0; i < kAxes.size(); ++i) {
    const Axis& axis = kAxes[i];
    const auto row = static_cast<Eigen::Index>(i);
    const LoopDesign& loop = i < 2 ? c.roll_pitch : c.yaw;
    const double rate_gain = 2.0 * loop.damping * loop.natural_frequency;
    const double angle_gain = loop.natural_frequency / (2.0 * loop.damping);
    const double p =
        std::clamp(rate_gain * vehicle.inertia_diagonal[row] / torque[row], axis.least, axis.most);
    all.push_back({fmt::format("MC_{}RATE_P", axis.name), p});
    all.push_back({fmt::format("MC_{}RATE_I", axis.name), axis.integral * p});
    all.push_back({fmt::format("MC_{}RATE_D", axis.name), axis.derivative * p});
    all.push_back({fmt::format("MC_{}_P", axis.name), std::min(angle_gain, axis.angle_most)});
  }
}

}  // namespace

std::vector<Px4Parameter> px4_parameters(const VehicleSettings& vehicle, bool vision) {
  const MotorOutputs motors(vehicle);
  const std::vector<Px4Rotor> rotors = rotors_of(vehicle);
  std::vector<Px4Parameter> all = {
      {"CA_AIRFRAME", 0, true},
      {"CA_ROTOR_COUNT", static_cast<double>(rotors.size()), true},
  };
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    const Vector3d& p = rotors[i].position_frd;
    all.push_back({fmt::format("CA_ROTOR{}_PX", i), p.x()});
    all.push_back({fmt::format("CA_ROTOR{}_PY", i), p.y()});
    all.push_back({fmt::format("CA_ROTOR{}_PZ", i), p.z()});
    all.push_back({fmt::format("CA_ROTOR{}_KM", i), rotors[i].moment_ratio});
    all.push_back({fmt::format("PWM_MAIN_FUNC{}", i + 1), 101.0 + static_cast<double>(i), true});
  }
  const double u = motors.hover();
  const double f = motors.square_share();
  all.push_back({"THR_MDL_FAC", f});
  all.push_back({"MPC_THR_HOVER", f * u * u + (1.0 - f) * u});
  all.push_back({"MPC_TILTMAX_AIR", std::clamp(vehicle.controller.tilt_max_deg, 20.0, 89.0)});
  add_loops(vehicle, rotors, all);
  all.push_back({"SIM_BAT_ENABLE", 1, true});
  all.push_back({"COM_RC_IN_MODE", 4, true});
  all.push_back({"NAV_DLL_ACT", 0, true});
  if (vision) {
    all.push_back({"EKF2_EV_CTRL", 15, true});
    all.push_back({"EKF2_GPS_CTRL", 0, true});
    all.push_back({"EKF2_HGT_REF", 3, true});
    all.push_back({"EKF2_EV_DELAY", 0});
    all.push_back({"COM_ARM_WO_GPS", 1, true});
  } else {
    all.push_back({"EKF2_GPS_DELAY", kGpsDelay});
  }
  return all;
}

std::string px4_parameter_file(const VehicleSettings& vehicle, bool vision) {
  std::string text = fmt::format(
      "# {}: parameters of PX4, made by `pointflight vehicle px4-params`\n"
      "# Vehicle-Id Component-Id Name Value Type\n",
      vehicle.title);
  for (const Px4Parameter& p : px4_parameters(vehicle, vision)) {
    text += p.is_integer ? fmt::format("1\t1\t{}\t{:.0f}\t6\n", p.name, p.value)
                         : fmt::format("1\t1\t{}\t{:.7g}\t9\n", p.name, p.value);
  }
  return text;
}

}  // namespace pointflight
