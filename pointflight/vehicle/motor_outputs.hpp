// Which output of a flight controller drives which rotor, and how fast.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "pointflight/vehicle/airframe.hpp"

namespace pointflight {

/// Outputs 1, 2, .. are 0 to 1 and set a rotor's speed from its least to its greatest, straight:
/// what speed controllers do. Quadrotors in an X are numbered as PX4 and ArduPilot number them
/// (front right, rear left, front left, rear right), others as their vehicle file does.
class MotorOutputs {
 public:
  /// Of a vehicle file, which is not needed afterwards.
  explicit MotorOutputs(const VehicleSettings& vehicle);

  /// True of quadrotors with a rotor in each quarter.
  [[nodiscard]] bool is_x_quad() const { return is_x_quad_; }
  /// Rotor (number in the vehicle file) of each output.
  [[nodiscard]] const std::vector<std::size_t>& rotors() const { return rotors_; }
  /// Speeds of all rotors, in the order of the vehicle file, rad/s; 0 unless it is armed. Outputs
  /// that are missing or not finite are 0, others are cut to 0 .. 1.
  [[nodiscard]] std::vector<double> speeds(std::span<const float> outputs, bool is_armed) const;
  /// The output of a speed, rad/s; the other way round.
  [[nodiscard]] double output_of(double speed) const;
  /// Of all rotors together, when it hovers.
  [[nodiscard]] double hover() const { return output_of(hover_speed_); }
  /// The share f of the square in PX4's thrust curve, T / T_max = f u^2 + (1 - f) u (THR_MDL_FAC),
  /// by least squares over u from 0 to 1.
  [[nodiscard]] double square_share() const;

 private:
  double speed_min_, speed_max_, hover_speed_;
  std::vector<std::size_t> rotors_;
  bool is_x_quad_;
};

}  // namespace pointflight
