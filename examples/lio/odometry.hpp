// LiDAR-inertial odometry for teaching: an error-state Kalman filter that an IMU carries forward
// and that points pull onto the planes of a map of points (as FAST-LIO does; Xu et al. 2022).
#pragma once

#include <deque>
#include <span>
#include <vector>

#include "examples/lio/point_map.hpp"
#include "pointflight/core/time.hpp"
#include "pointflight/geometry/types.hpp"

namespace lio {

using pointflight::Pose;
using pointflight::Quaterniond;
using pointflight::SimTime;

/// What an IMU says, by its own clock: rad/s, and m/s^2 with +g on z at rest.
struct ImuReading {
  SimTime time;
  Vector3d gyro, accel;
};

/// A point as the LiDAR saw it, in its own frame at the time at which it was seen.
struct LidarPoint {
  SimTime time;
  Vector3d position;
};

/// Position, attitude and what else is to be known of an IMU in its world.
struct State {
  Quaterniond rotation = Quaterniond::Identity();  ///< From IMU axes to the world.
  Vector3d position = Vector3d::Zero();            ///< m
  Vector3d velocity = Vector3d::Zero();            ///< m/s
  Vector3d gyro_bias = Vector3d::Zero();           ///< rad/s
  Vector3d accel_bias = Vector3d::Zero();          ///< m/s^2
  Vector3d gravity = Vector3d(0.0, 0.0, -9.81);    ///< In the world, m/s^2.

  [[nodiscard]] Pose pose() const { return {rotation, position}; }
};

/// Figures of the filter.
struct Tuning {
  double gyro_noise = 2e-3;       ///< rad/s/sqrt(Hz), vibration included
  double accel_noise = 5e-2;      ///< m/s^2/sqrt(Hz), vibration included
  double gyro_bias_walk = 1e-5;   ///< rad/s^2/sqrt(Hz)
  double accel_bias_walk = 1e-4;  ///< m/s^3/sqrt(Hz)
  double point_sigma = 0.04;      ///< m, of a point from its plane
  double thinning = 0.4;          ///< m: one point per cube of this width is used
  int iterations = 4;
};

class Odometry {
 public:
  /// `start`: the IMU's pose at first, which it calls so; everything else it finds out.
  /// `T_imu_lidar`: where the LiDAR sits.
  Odometry(const Pose& start, const Pose& T_imu_lidar, const Tuning& tuning = {});

  /// Readings in the order of their times.
  void add(const ImuReading& reading) { readings_.push_back(reading); }

  /// The points of a scan, once the readings up to its end are there. Returns the state at the end.
  const State& add_scan(std::span<const LidarPoint> points, SimTime end);

  [[nodiscard]] const State& state() const { return state_; }
  [[nodiscard]] const PointMap& map() const { return map_; }

 private:
  static constexpr int kSize = 18;  ///< rotation, position, velocity, biases, gravity
  using Matrix = Eigen::Matrix<double, kSize, kSize>;
  using Vector = Eigen::Matrix<double, kSize, 1>;
  struct Stop {  ///< Where the IMU was on its way through a scan.
    SimTime time;
    Pose pose;
  };

  void carry_to(SimTime end);
  void propagate(const ImuReading& reading, double dt);
  [[nodiscard]] std::vector<Vector3d> deskewed(std::span<const LidarPoint> points) const;
  [[nodiscard]] std::vector<Vector3d> thinned(const std::vector<Vector3d>& points) const;
  void correct(const std::vector<Vector3d>& points);
  [[nodiscard]] static State moved(const State& state, const Vector& by);
  [[nodiscard]] static Vector between(const State& from, const State& to);

  Pose T_imu_lidar_;
  Tuning tuning_;
  State state_;
  Matrix covariance_ = Matrix::Zero();
  std::deque<ImuReading> readings_;
  std::vector<Stop> way_;
  SimTime time_;
  bool started_ = false;
  PointMap map_;
};

}  // namespace lio
