#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/core/settings.hpp"
#include "pointflight/geometry/solid_kind.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/vehicle/controller_kind.hpp"
#include "pointflight/vehicle/imu_errors.hpp"

namespace pointflight {

/// A vehicle's rotors: four at least, and so many at most.
inline constexpr std::size_t kMostRotors = 32;

/// One rotor: where it sits and how it turns. All thrust along body +z.
struct RotorPlacement {
  Vector3d position = Vector3d::Zero();  ///< m, body frame.
  double yaw_sign = 1.0;  ///< Sign of the reaction torque about body z that its thrust comes with.
};

/// Rotors are alike; their placement differs.
struct RotorModel {
  double thrust_coefficient = 0.0;  ///< k_f: thrust = k_f w^2, N s^2.
  double torque_coefficient = 0.0;  ///< k_m: reaction torque = k_m w^2, N m s^2.
  double inertia = 0.0;             ///< J_r about its axis, kg m^2: gyroscopic and spin-up torque.
  double drag_coefficient = 0.0;    ///< Linear rotor drag: force = -c w v_perp, N s^2 / m.
  double speed_min = 0.0;           ///< rad/s
  double speed_max = 0.0;           ///< rad/s
  double natural_frequency = 0.0;   ///< Of the speed's second-order response, rad/s; 0: ideal.
  double damping = 1.0;  ///< Of the speed's response; used with a natural frequency only.
  double radius = 0.0;   ///< Of the propeller, m: ground effect, advance ratio; 0: neither.
  /// Advance ratios J = v / (n D), ascending: v the air's speed against the thrust (the rotor
  /// climbs), n turns per second, D the diameter. Empty: thrust and torque do not depend on v.
  std::vector<double> advance_ratios;
  std::vector<double>
      thrust_shares;  ///< C_T(J) / C_T(0) at these, straight between, constant beyond.
  std::vector<double> torque_shares;  ///< C_P(J) / C_P(0) at these.

  /// Shares of the static thrust and torque.
  struct Shares {
    double thrust = 1.0;  ///< Of k_f w^2.
    double torque = 1.0;  ///< Of k_m w^2.
  };
  /// At `climb` m/s along the axis and `speed` rad/s (> 0).
  [[nodiscard]] Shares shares(double climb, double speed) const;
  /// Of the static thrust, at `climb` m/s along the axis and `speed` rad/s (> 0).
  [[nodiscard]] double thrust_share(double climb, double speed) const {
    return shares(climb, speed).thrust;
  }
  /// Speed (rad/s) that gives a thrust (N, 0 or more) at `climb` m/s, whatever the limits.
  [[nodiscard]] double speed_for(double thrust, double climb) const;
  /// Of the static torque.
  [[nodiscard]] double torque_share(double climb, double speed) const {
    return shares(climb, speed).torque;
  }
};

/// Gains follow from these and from the airframe's mass and inertia.
struct LoopDesign {
  double natural_frequency = 1.0;  ///< rad/s
  double damping = 0.9;            ///< Ratio; 1 is critical.
  /// Position loops: how quickly steady disturbances are learnt, in units of natural_frequency;
  /// attitude loops: integral gain in units of natural_frequency^3.
  double integral = 0.0;
};

/// How a vehicle is controlled: loops from position to rotors.
struct ControllerSettings {
  Choice<ControllerKind> kind{};          ///< "cascade", "geometric" or an own one.
  LoopDesign horizontal{1.8, 0.9, 0.25};  ///< Position loop, world x and y.
  LoopDesign vertical{2.5, 0.9, 0.25};    ///< Position loop, world z.
  LoopDesign roll_pitch{12.0, 0.9, 0.0};  ///< Attitude loop about body x and y.
  LoopDesign yaw{4.0, 0.9, 0.0};          ///< Attitude loop about body z.
  double speed_max = 15.0;                ///< Of velocity and position commands, m/s.
  double tilt_max_deg = 35.0;             ///< From 90 on: none (geometric only).
  double acceleration_max = 10.0;         ///< Of the position loop, horizontal, m/s^2.
  double climb_acceleration_max = 10.0;   ///< The same upwards, m/s^2.
  double error_max = 5.0;                 ///< Position errors count no more than this, m.
  double integral_max = 4.0;              ///< Disturbance that the position loops allow for, m/s^2.
  double body_rate_max = 10.0;            ///< Demanded rates, rad/s.
  bool reallocate = true;                 ///< Rotors that fail are allowed for.
};

/// Where an IMU sits and how it errs (REP 145 axes).
struct ImuSettings {
  double rate = 200.0;                           ///< Hz
  Vector3d position = Vector3d::Zero();          ///< m, body frame.
  Vector3d rotation_rpy_deg = Vector3d::Zero();  ///< Of its axes in the body.
  std::string part;  ///< Name of a shipped part (`load_imu_part`), whose errors it has; or empty.
  std::optional<ImuErrors> part_errors;  ///< The part's, once the file is read.
  ImuErrors errors;                      ///< Of an IMU that is no shipped part.

  /// The part's errors, or its own.
  [[nodiscard]] const ImuErrors& in_use() const { return part_errors ? *part_errors : errors; }
};

/// How rotors shake an IMU.
struct VibrationSettings {
  double rotor_accel = 0.0;  ///< Amplitude across the axis by each rotor's imbalance, m/s^2.
  double blade_accel = 0.0;  ///< Amplitude along the axis at the blades' frequency, m/s^2.
  double rotor_gyro = 0.0;   ///< Amplitude of rates by each rotor's imbalance, rad/s.
  std::int64_t blades = 2;   ///< Of each propeller.

  /// True if there is none.
  [[nodiscard]] bool is_off() const {
    return rotor_accel == 0.0 && blade_accel == 0.0 && rotor_gyro == 0.0;
  }
};

/// LiPo battery: 3.5 V per cell when empty to 4.2 V when full, less what the current takes.
struct BatterySettings {
  double cells = 0.0;       ///< In series; 0: none, full power for ever.
  double capacity = 0.0;    ///< Ah
  double resistance = 0.0;  ///< Of all cells and leads, ohm.
  double efficiency = 0.7;  ///< Of motors and speed controllers: shaft power by electrical.
  double reserve = 0.1;     ///< Share of the capacity that is left when it counts as low.
};

/// What it looks like to LiDARs (`assembly_of`); what is 0 follows from where the rotors sit.
struct AirframeSettings {
  bool seen_as_hull = false;                ///< LiDARs see its hull, as a solid, instead.
  Vector3d body_size = Vector3d::Zero();    ///< Of the box in the middle, m.
  Vector3d body_center = Vector3d::Zero();  ///< Of the box, body frame, m.
  double arm_radius = 0.0;                  ///< m
  double propeller_radius = 0.0;            ///< m; 0: `rotor.radius`.
  double blade_chord = 0.0;                 ///< Their width, m.
  double blade_pitch_deg = 14.0;            ///< Against the disc.
};

/// A vehicle file, `data/vehicles/<name>.yaml`.
struct VehicleSettings {
  std::string path;                                   ///< Of the file, for messages.
  std::string title;                                  ///< Name for users.
  std::string source;                                 ///< Where the figures come from.
  double mass = 1.0;                                  ///< kg
  Vector3d inertia_diagonal = Vector3d::Ones();       ///< kg m^2
  Choice<SolidKind> shape;                            ///< Of the hull, which must stay free.
  SolidSize hull_size = {0.3, 1.0, {0.5, 0.5, 0.2}};  ///< Of the hull.
  double intensity = 100.0;                           ///< Of LiDAR returns from it.
  Vector3d drag_area = Vector3d::Zero();              ///< c_d A along each body axis, m^2.
  Vector3d rotational_drag = Vector3d::Zero();        ///< K_d about each body axis, N m s^2.
  RotorModel rotor;                                   ///< One for all rotors.
  /// Four to `kMostRotors`; commands and states count them in this order.
  std::vector<RotorPlacement> rotors;
  /// The innermost command that its autopilot takes (`setpoint_names`).
  std::string lowest_command = "rotor_speeds";
  ControllerSettings controller;  ///< Loops and limits.
  ImuSettings imu;                ///< One on each vehicle.
  VibrationSettings vibration;    ///< At hover speed; grows with the square of the rotors'.
  BatterySettings battery;        ///< Without cells: none.
  AirframeSettings airframe;      ///< What LiDARs see.

  /// What must stay free of everything; around the body's origin.
  [[nodiscard]] Solid hull() const;

  [[nodiscard]] double hover_speed() const;  ///< rad/s of each rotor.
  /// Of all rotors at their greatest speed, against the weight.
  [[nodiscard]] double thrust_to_weight() const;

  /// What the air does to it as it moves at `v_body` through still air, rotors at hover speed,
  /// body frame, m/s^2.
  [[nodiscard]] Vector3d drag_in_still_air(const Vector3d& v_body) const;
};

/// The one list of keys of a vehicle file.
void describe(SettingsVisitor& visitor, VehicleSettings& settings);

/// Markdown table of all keys.
std::string vehicle_reference();

/// Reads a vehicle by name ("quad_330") or path; relative paths are taken from `base`.
VehicleSettings load_vehicle(const std::string& name_or_path, const std::string& base = {});

/// From text, for tests and fuzzers.
VehicleSettings parse_vehicle(std::string_view text, const std::string& path);

}  // namespace pointflight
