// What an odometry believes instead of the truth.
#pragma once

#include <cstdint>

#include "pointflight/core/random.hpp"
#include "pointflight/core/settings.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

/// How an odometry errs; all zero: it reports the truth.
struct EstimateSettings {
  double position_walk = 0.0;   ///< Drift of each coordinate, m/sqrt(s).
  double position_limit = 0.0;  ///< Deviation at which drift stays, m; 0: it goes on.
  double yaw_walk_deg = 0.0;    ///< Drift of the heading, deg/sqrt(s).
  double yaw_limit_deg = 0.0;   ///< As for positions, deg.
  double position_noise = 0.0;  ///< White, of each coordinate, m.
  double yaw_noise_deg = 0.0;   ///< White, deg.
  double tilt_noise_deg = 0.0;  ///< White, of roll and of pitch, which gravity keeps from drifting.
  double velocity_noise = 0.0;  ///< White, of each component, m/s.
  double latency = 0.0;         ///< From a state to its report, s.
  double dropout = 0.0;         ///< Share of reports that are lost.

  /// The truth, at once.
  bool operator==(const EstimateSettings&) const = default;
  /// True where what is reported is the truth, if perhaps late or lost.
  [[nodiscard]] bool is_true() const;
};

/// Their keys.
void describe(SettingsVisitor& visitor, EstimateSettings& settings);

/// What an estimate is off by: (estimate) = (error) + (truth).
struct EstimateError {
  Vector3d p_world = Vector3d::Zero();  ///< m
  Vector3d v_world = Vector3d::Zero();  ///< White part, m/s; the heading's error comes on top.
  double yaw = 0.0;                     ///< About world z, rad.
  Vector3d rotation_body = Vector3d::Zero();  ///< Roll and pitch, rad.

  /// What is believed of a true state: a frame that has moved and turned about the vehicle. Rates
  /// are those of the gyroscope, true.
  [[nodiscard]] RigidBodyState on(const RigidBodyState& truth) const;
};

/// Variances of an estimate's error, of each axis.
struct EstimateVariance {
  double position = 0.0;  ///< m^2
  double velocity = 0.0;  ///< m^2/s^2, in the body's frame: the heading's error does not count.
  double tilt = 0.0;      ///< rad^2, of roll and of pitch.
  double yaw = 0.0;       ///< rad^2
};

/// Drift is a random walk, d' = w n, or, with a limit b, drawn back to zero with the time constant
/// 2 b^2 / w^2, so that its deviation comes to b and begins as that of the walk. Exact from sample
/// to sample; draws are addressed by the sample's number.
class Estimator {
 public:
  /// `seed` and the vehicle's `number` address the draws; `rate`: of the reports, Hz.
  Estimator(const EstimateSettings& settings,
            double rate,
            std::uint64_t seed,
            std::uint32_t number);

  /// From one report to the next.
  struct Memory {
    std::int64_t index = -1;  ///< Of the last; none is off by anything before the first.
    Vector3d position = Vector3d::Zero();  ///< Drift, m.
    double yaw = 0.0;                      ///< Drift, rad.
    double position_variance = 0.0;        ///< Of the drift, m^2.
    double yaw_variance = 0.0;             ///< The same, rad^2.
  };

  /// Of report number `index`; ascending, some may be left out.
  [[nodiscard]] EstimateError error(std::int64_t index, Memory& memory) const;
  /// Of the report that `memory` is of.
  [[nodiscard]] EstimateVariance variance(const Memory& memory) const;
  /// True if a report is lost.
  [[nodiscard]] bool loses(std::int64_t index) const;
  /// As given.
  [[nodiscard]] const EstimateSettings& settings() const { return settings_; }

 private:
  struct Step {
    double keep;   ///< Of the drift.
    double added;  ///< Variance.
  };
  [[nodiscard]] Step step_of(double walk, double limit, double dt) const;

  EstimateSettings settings_;
  double rate_;
  RandomStream random_;
};

}  // namespace pointflight
