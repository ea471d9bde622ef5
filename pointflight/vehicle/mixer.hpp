#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "pointflight/vehicle/airframe.hpp"

namespace pointflight {

/// Thrust and torque that a controller asks for, body frame.
struct Wrench {
  double thrust = 0.0;                 ///< N along body +z.
  Vector3d torque = Vector3d::Zero();  ///< N m
};

/// How a vehicle moves through the air around it: what its rotors climb at.
struct AirMotion {
  Vector3d v_body = Vector3d::Zero();      ///< m/s
  Vector3d omega_body = Vector3d::Zero();  ///< rad/s
};

/// What the mixer takes from a vehicle's settings, worked out once.
struct MixerModel {
  /// Thrusts by wrench: of each rotor for thrust, and torque about x, y, z.
  std::array<std::array<double, 4>, kMostRotors> inverse{};
  double thrust_min = 0.0;  ///< Of a rotor, N.
  double thrust_max = 0.0;  ///< N
};

/// Turns a wrench into rotor speeds: the (pseudo-)inverse of the rotors' geometry, any layout.
///
/// Where a rotor would leave its limits, yaw torque gives way first, then thrust moves so that roll
/// and pitch can be kept, then those shrink.
class Mixer {
 public:
  /// Throws InputError if the layout cannot make roll, pitch and yaw.
  explicit Mixer(const VehicleSettings& settings);

  /// Rotor speeds, rad/s, within the rotors' limits. Rotors that climb turn faster for the same
  /// thrust, if the vehicle file says how thrust falls with the advance ratio.
  [[nodiscard]] std::vector<double> speeds(const Wrench& wrench,
                                           const AirMotion& motion = {}) const;

  /// The same if rotors turn at a share of what they are told (0 to 1, one each): those that are
  /// left make roll and pitch before thrust, and yaw last, as nearly as they can.
  [[nodiscard]] std::vector<double> speeds_with_failed_rotors(const Wrench& wrench,
                                                              const AirMotion& motion,
                                                              std::span<const double> shares) const;
  /// For the same in many lanes.
  [[nodiscard]] const MixerModel& model() const { return model_; }

  /// True if these can hover without spinning.
  [[nodiscard]] bool holds_heading(std::span<const double> shares) const;

  /// Wrench of given speeds (without drag and lag): the inverse of `speeds` inside the limits.
  /// One speed per rotor.
  [[nodiscard]] Wrench wrench(const std::vector<double>& speeds,
                              const AirMotion& motion = {}) const;

 private:
  [[nodiscard]] Eigen::VectorXd thrusts_of_what_is_left(const Wrench& wrench,
                                                        std::span<const double> shares) const;
  [[nodiscard]] double climb_of(std::size_t rotor, const AirMotion& motion) const;

  VehicleSettings settings_;
  Eigen::MatrixXd allocation_;  ///< 4 x rotors: wrench = allocation * thrusts.
  MixerModel model_;
  double weight_ = 0.0;  ///< N
};

}  // namespace pointflight
