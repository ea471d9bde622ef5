#pragma once

#include <cstdint>
#include <string>

#include "pointflight/core/settings.hpp"

namespace pointflight {

/// How the three axes of a gyroscope (rad/s) or accelerometer (m/s^2) err.
struct TriadErrors {
  double noise_density = 0.0;  ///< White noise, one-sided, unit/sqrt(Hz).
  double bias_walk = 0.0;      ///< Random walk of the bias, unit/s/sqrt(Hz).
  /// Flicker noise B, unit: the Allan deviation has a floor of sqrt(2 ln 2 / pi) B = 0.664 B.
  double bias_instability = 0.0;
  double turn_on_bias = 0.0;      ///< Deviation of each axis' bias from run to run, unit.
  double scale_error = 0.0;       ///< Deviation of each axis' scale from 1, from run to run.
  double misalignment_deg = 0.0;  ///< Deviation of the angle by which each axis leans to another.
  double range = 0.0;             ///< Saturates at plus and minus this, unit; 0: never.
};

/// How an IMU errs beyond where it sits.
struct ImuErrors {
  TriadErrors gyro;                 ///< rad/s
  TriadErrors accel;                ///< m/s^2
  double gyro_g_sensitivity = 0.0;  ///< Deviation of the gyro's bias per force, rad/s per m/s^2.
  /// Of both outputs, over their ranges; 0: not rounded.
  std::int64_t bits = 0;
  std::int64_t accel_bits = 0;  ///< Of the accelerometer, if it has others; 0: as `bits`.
  double clock_offset = 0.0;    ///< Time stamps are late by this, s.
  double clock_jitter = 0.0;    ///< Deviation of each time stamp, s.

  /// True if time stamps are not the times of the samples.
  [[nodiscard]] bool clock_errs() const { return clock_offset != 0.0 || clock_jitter > 0.0; }
};

/// The keys of a vehicle file's `imu` section that older versions had: noise and walk.
void describe_noise(SettingsVisitor& visitor, ImuErrors& errors);

/// The others.
void describe_beyond_noise(SettingsVisitor& visitor, ImuErrors& errors);

/// An IMU by itself: a file `data/imus/<name>.yaml`.
struct ImuPart {
  std::string title;   ///< Maker and model.
  std::string source;  ///< Where the figures come from.
  ImuErrors errors;    ///< Its figures.
};
/// The keys of such a file.
void describe(SettingsVisitor& visitor, ImuPart& part);

/// A shipped part by name ("icm40609"). Throws InputError that lists the names.
ImuPart load_imu_part(const std::string& name);

}  // namespace pointflight
