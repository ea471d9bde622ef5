// What a flight controller wrote down of a flight, in our frames and units.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "pointflight/geometry/types.hpp"
#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

/// Outputs of a flight controller to its motors.
struct LoggedOutputs {
  double time = 0.0;           ///< s
  std::vector<float> outputs;  ///< Motor 1, 2, .. from 0 to 1, as `MotorOutputs`; NaN: stopped.
};

/// A sample of its inertial sensors.
struct LoggedImu {
  double time = 0.0;                  ///< s
  Vector3d gyro = Vector3d::Zero();   ///< rad/s, body: front, left, up.
  Vector3d accel = Vector3d::Zero();  ///< Specific force, m/s^2, the same axes.
};

/// Its attitude, as it estimated it.
struct LoggedAttitude {
  double time = 0.0;                                   ///< s
  Quaterniond q_world_body = Quaterniond::Identity();  ///< World: east, north, up.
};

/// Its motion, as it estimated it.
struct LoggedMotion {
  double time = 0.0;                    ///< s
  Vector3d p_world = Vector3d::Zero();  ///< m from where its estimator began; east, north, up.
  Vector3d v_world = Vector3d::Zero();  ///< m/s
};

/// A log of PX4 (ULog) or ArduPilot (DataFlash). Each list by time, ascending; times count from the
/// start of the firmware.
struct FlightLog {
  std::string path;                      ///< Of the file, for messages.
  std::string firmware;                  ///< "PX4" or "ArduPilot".
  std::vector<LoggedOutputs> outputs;    ///< To motors.
  std::vector<LoggedImu> imu;            ///< Of its first IMU.
  std::vector<LoggedAttitude> attitude;  ///< Estimated.
  std::vector<LoggedMotion> motion;      ///< Estimated.
  std::string outputs_from;              ///< The message that the outputs are from.
  std::uint64_t skipped = 0;             ///< Gaps, and what made no sense.

  /// Where it was, as estimated, and how it turned, as its gyroscope measured; straight between
  /// records. `time` within all lists.
  [[nodiscard]] RigidBodyState state_at(double time) const;
};

/// Reads a log. Outputs are speeds of motors from least to greatest: PX4's thrust curve
/// (THR_MDL_FAC) and limits of pulses (PWM_MAIN_*, MOT_PWM_*, SERVOn_FUNCTION) are taken out by the
/// log's own parameters. Throws InputError that says which message is missing, and how to have it
/// logged, for a log without outputs, IMU, attitude or motion.
FlightLog read_flight_log(const std::string& path);

/// The same from bytes; `path` stands in messages.
FlightLog parse_flight_log(std::span<const std::byte> bytes, const std::string& path);

/// Messages per second of a list.
template <class Record>
double rate_of(const std::vector<Record>& records) {
  if (records.size() < 2 || !(records.back().time > records.front().time)) return 0.0;
  return static_cast<double>(records.size() - 1) / (records.back().time - records.front().time);
}

}  // namespace pointflight
