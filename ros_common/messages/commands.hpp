// What vehicles are told: mavros_msgs, the quadrotor_msgs of planners.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "ros_common/messages/geometry.hpp"

namespace pointflight::msg {

/// An attitude or body rates with a thrust, as MAVROS takes them.
struct AttitudeTarget {
  static constexpr TypeName kType{
      "mavros_msgs",
      "AttitudeTarget",
      "mavros_msgs",
      "uint8 IGNORE_ROLL_RATE = 1\nuint8 IGNORE_PITCH_RATE = 2\nuint8 IGNORE_YAW_RATE = 4\n"
      "uint8 IGNORE_THRUST = 64\nuint8 IGNORE_ATTITUDE = 128\n"};
  /// Bits of `type_mask`: parts that do not count.
  enum Mask : std::uint8_t {
    kIgnoreRollRate = 1,
    kIgnorePitchRate = 2,
    kIgnoreYawRate = 4,
    kIgnoreRates = 7,
    kIgnoreThrust = 64,
    kIgnoreAttitude = 128
  };
  Header header;               ///< Its frame is not looked at.
  std::uint8_t type_mask = 0;  ///< `Mask`; MAVROS has no bit for the attitude's parts.
  Quaternion orientation;      ///< Body axes (x forward, y left, z up) in the world.
  Vector3 body_rate;           ///< rad/s, about the body's axes.
  float thrust = 0.0f;         ///< Share of the thrust of all rotors, 0 to 1.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("type_mask", m.type_mask);
    v("orientation", m.orientation);
    v("body_rate", m.body_rate);
    v("thrust", m.thrust);
  }
};

/// EGO-Planner, FUEL, RACER ("short").
struct PositionCommandShort {
  static constexpr TypeName kType{
      "quadrotor_msgs",
      "PositionCommand",
      "quadrotor_msgs",
      "uint8 TRAJECTORY_STATUS_EMPTY = 0\nuint8 TRAJECTORY_STATUS_READY = 1\n"
      "uint8 TRAJECTORY_STATUS_COMPLETED = 3\nuint8 TRAJECTROY_STATUS_ABORT = 4\n"
      "uint8 TRAJECTORY_STATUS_ILLEGAL_START = 5\nuint8 TRAJECTORY_STATUS_ILLEGAL_FINAL = 6\n"
      "uint8 TRAJECTORY_STATUS_IMPOSSIBLE = 7\n"};
  Header header;   ///< World frame or its alias; the stamp is not looked at.
  Point position;  ///< m
  /// m/s and m/s^2: feed-forward.
  ///@{
  Vector3 velocity, acceleration;
  ///@}
  /// rad from world x towards y, and rad/s.
  ///@{
  double yaw = 0.0, yaw_dot = 0.0;
  ///@}
  /// Gains for the follower: not used, vehicles have their own.
  ///@{
  std::array<double, 3> kx{}, kv{};
  ///@}
  std::uint32_t trajectory_id = 0;   ///< The planner's count: not used.
  std::uint8_t trajectory_flag = 0;  ///< Not used: the command is followed whatever it says.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("position", m.position);
    v("velocity", m.velocity);
    v("acceleration", m.acceleration);
    v("yaw", m.yaw);
    v("yaw_dot", m.yaw_dot);
    v("kx", m.kx);
    v("kv", m.kv);
    v("trajectory_id", m.trajectory_id);
    v("trajectory_flag", m.trajectory_flag);
  }
};

/// MARSIM, SUPER, ROG-Map ("long").
struct PositionCommandLong {
  static constexpr TypeName kType{
      "quadrotor_msgs",
      "PositionCommand",
      "mars_quadrotor_msgs",
      "uint8 TRAJECTORY_STATUS_EMPTY = 0\nuint8 TRAJECTORY_STATUS_EMER = 2\n"
      "uint8 TRAJECTORY_STATUS_READY = 1\nuint8 TRAJECTORY_STATUS_COMPLETED = 3\n"
      "uint8 TRAJECTROY_STATUS_ABORT = 4\nuint8 TRAJECTORY_STATUS_ILLEGAL_START = 5\n"
      "uint8 TRAJECTORY_STATUS_ILLEGAL_FINAL = 6\nuint8 TRAJECTORY_STATUS_IMPOSSIBLE = 7\n"
      "uint32 ACTION_STOP = 8\n"};
  Header header;   ///< World frame or its alias; the stamp is not looked at.
  Point position;  ///< m
  /// Feed-forward in m/s, m/s^2 and m/s^3; angular_velocity, attitude and thrust are not used.
  ///@{
  Vector3 velocity, acceleration, jerk, angular_velocity, attitude, thrust;
  ///@}
  /// rad from world x towards y, and rad/s; the two norms are not used.
  ///@{
  double yaw = 0.0, yaw_dot = 0.0, vel_norm = 0.0, acc_norm = 0.0;
  ///@}
  /// Gains for the follower: not used, vehicles have their own.
  ///@{
  std::array<double, 3> kx{}, kv{};
  ///@}
  std::uint32_t trajectory_id = 0;   ///< The planner's count: not used.
  std::uint8_t trajectory_flag = 0;  ///< Not used: the command is followed whatever it says.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("position", m.position);
    v("velocity", m.velocity);
    v("acceleration", m.acceleration);
    v("jerk", m.jerk);
    v("angular_velocity", m.angular_velocity);
    v("attitude", m.attitude);
    v("thrust", m.thrust);
    v("yaw", m.yaw);
    v("yaw_dot", m.yaw_dot);
    v("vel_norm", m.vel_norm);
    v("acc_norm", m.acc_norm);
    v("kx", m.kx);
    v("kv", m.kv);
    v("trajectory_id", m.trajectory_id);
    v("trajectory_flag", m.trajectory_flag);
  }
};

/// multi_map_server's copy in FUEL and RACER ("oldest").
struct PositionCommandOldest {
  static constexpr TypeName kType{"quadrotor_msgs", "PositionCommand", "quadrotor_msgs", "", true};
  Header header;   ///< World frame or its alias; the stamp is not looked at.
  Point position;  ///< m
  /// m/s and m/s^2: feed-forward.
  ///@{
  Vector3 velocity, acceleration;
  ///@}
  /// rad from world x towards y, and rad/s.
  ///@{
  double yaw = 0.0, yaw_dot = 0.0;
  ///@}
  /// Gains for the follower: not used, vehicles have their own.
  ///@{
  std::array<double, 3> kx{}, kv{};
  ///@}
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("position", m.position);
    v("velocity", m.velocity);
    v("acceleration", m.acceleration);
    v("yaw", m.yaw);
    v("yaw_dot", m.yaw_dot);
    v("kx", m.kx);
    v("kv", m.kv);
  }
};

/// Take-off and landing by EGO-Planner's and px4ctrl's message.
struct TakeoffLand {
  static constexpr TypeName kType{
      "quadrotor_msgs", "TakeoffLand", "quadrotor_msgs", "uint8 TAKEOFF = 1\nuint8 LAND = 2\n"};
  /// Values of `takeoff_land_cmd`.
  enum Command : std::uint8_t { kTakeoff = 1, kLand = 2 };
  std::uint8_t takeoff_land_cmd = 0;  ///< `Command`; all but kTakeoff lands.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("takeoff_land_cmd", m.takeoff_land_cmd);
  }
};

}  // namespace pointflight::msg
