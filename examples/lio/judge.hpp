// The odometry beside a flight, and how far it is off.
#pragma once

#include <iosfwd>
#include <optional>

#include "examples/lio/odometry.hpp"
#include "pointflight/sim/simulation.hpp"

namespace lio {

/// Hands what the first vehicle measures to an odometry and compares it with the truth.
class Judge : public pointflight::SampleSink {
 public:
  /// Without times all points of a scan count as seen at its end. `estimate`: where poses go as TUM
  /// (of the IMU), or null. The vehicle has a LiDAR.
  Judge(const pointflight::VehicleAgent& vehicle,
        bool with_times,
        std::ostream* estimate = nullptr,
        const Tuning& tuning = {});

  void on_sample(const pointflight::Sample& sample) override;

  [[nodiscard]] double way() const { return way_; }                    ///< Flown, m.
  [[nodiscard]] double fastest_turn() const { return fastest_turn_; }  ///< rad/s
  [[nodiscard]] double last_error() const { return last_error_; }      ///< Of the position, m.
  [[nodiscard]] double worst_error() const { return worst_error_; }    ///< m
  [[nodiscard]] double rms_error() const;                              ///< Over all scans, m.
  [[nodiscard]] std::size_t map_points() const;

 private:
  void take(const pointflight::StateSample& sample);
  void take(const pointflight::ScanSample& sample);

  bool with_times_;
  std::ostream* estimate_;
  Tuning tuning_;
  Pose T_body_imu_, T_imu_lidar_;
  std::optional<Odometry> odometry_;
  std::optional<Vector3d> last_place_;
  double way_ = 0.0, fastest_turn_ = 0.0, last_error_ = 0.0, worst_error_ = 0.0;
  double squares_ = 0.0, scans_ = 0.0;
};

}  // namespace lio
