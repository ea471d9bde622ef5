#pragma once

#include <Eigen/Core>
#include <vector>

#include "pointflight/vehicle/airframe.hpp"

namespace pointflight {

/// Thrust and torque that a controller asks for, body frame.
struct Wrench {
  double thrust = 0.0;                 ///< N along body +z.
  Vector3d torque = Vector3d::Zero();  ///< N m
};

/// Turns a wrench into rotor speeds: the (pseudo-)inverse of the rotors' geometry, any layout.
///
/// Where a rotor would leave its limits, yaw torque gives way first, then thrust moves so that roll
/// and pitch can be kept, then those shrink.
class Mixer {
 public:
  /// Throws InputError where the layout cannot make roll, pitch and yaw.
  explicit Mixer(const VehicleSettings& settings);

  /// Rotor speeds, rad/s, within the rotors' limits.
  [[nodiscard]] std::vector<double> speeds(const Wrench& wrench) const;

  /// Wrench of given speeds (without drag and lag): the inverse of `speeds` inside the limits.
  /// One speed a rotor.
  [[nodiscard]] Wrench wrench(const std::vector<double>& speeds) const;

 private:
  Eigen::MatrixXd allocation_;  ///< 4 x rotors: wrench = allocation * thrusts.
  Eigen::MatrixXd inverse_;     ///< rotors x 4
  double thrust_coefficient_;
  double thrust_min_;
  double thrust_max_;
};

}  // namespace pointflight
