#include "examples/lio/odometry.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "pointflight/geometry/rotation.hpp"

namespace lio {
namespace {

using Eigen::Matrix3d;
using pointflight::interpolate;
using pointflight::quaternion_from_rotation_vector;
using pointflight::rotation_vector;
using pointflight::to_seconds;

// positions in the error state
constexpr int kRotation = 0, kPosition = 3, kVelocity = 6, kGyroBias = 9, kAccelBias = 12,
              kGravity = 15;
constexpr double kGravityLength = 9.81;  // m/s^2
constexpr double kLeastRange = 0.3;      // m: nearer points are of the vehicle itself

Matrix3d cross(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace

Odometry::Odometry(const Pose& start, const Pose& T_imu_lidar, const Tuning& tuning)
    : T_imu_lidar_(T_imu_lidar), tuning_(tuning) {
  state_.rotation = start.rotation;
  state_.position = start.translation;
  // what may be wrong at first: the pose is how the world is defined
  const auto spread = [&](int at, double sigma) {
    covariance_.block<3, 3>(at, at) = Matrix3d::Identity() * sigma * sigma;
  };
  spread(kRotation, 1e-4);
  spread(kPosition, 1e-4);
  spread(kVelocity, 0.3);
  spread(kGyroBias, 0.02);
  spread(kAccelBias, 0.3);
  spread(kGravity, 0.4);
}

State Odometry::moved(const State& state, const Vector& by) {
  State s = state;
  s.rotation =
      (state.rotation * quaternion_from_rotation_vector(by.segment<3>(kRotation))).normalized();
  s.position += by.segment<3>(kPosition);
  s.velocity += by.segment<3>(kVelocity);
  s.gyro_bias += by.segment<3>(kGyroBias);
  s.accel_bias += by.segment<3>(kAccelBias);
  s.gravity += by.segment<3>(kGravity);
  return s;
}

Odometry::Vector Odometry::between(const State& from, const State& to) {
  Vector d;
  d.segment<3>(kRotation) = rotation_vector((from.rotation.conjugate() * to.rotation).normalized());
  d.segment<3>(kPosition) = to.position - from.position;
  d.segment<3>(kVelocity) = to.velocity - from.velocity;
  d.segment<3>(kGyroBias) = to.gyro_bias - from.gyro_bias;
  d.segment<3>(kAccelBias) = to.accel_bias - from.accel_bias;
  d.segment<3>(kGravity) = to.gravity - from.gravity;
  return d;
}

/// One reading, held for `dt` seconds.
void Odometry::propagate(const ImuReading& reading, double dt) {
  const Vector3d w = reading.gyro - state_.gyro_bias;
  const Vector3d a = reading.accel - state_.accel_bias;
  const Matrix3d r = state_.rotation.toRotationMatrix();
  Matrix f = Matrix::Identity();
  f.block<3, 3>(kRotation, kRotation) = quaternion_from_rotation_vector(-w * dt).toRotationMatrix();
  f.block<3, 3>(kRotation, kGyroBias) = -Matrix3d::Identity() * dt;
  f.block<3, 3>(kPosition, kVelocity) = Matrix3d::Identity() * dt;
  f.block<3, 3>(kVelocity, kRotation) = -r * cross(a) * dt;
  f.block<3, 3>(kVelocity, kAccelBias) = -r * dt;
  f.block<3, 3>(kVelocity, kGravity) = Matrix3d::Identity() * dt;
  covariance_ = f * covariance_ * f.transpose();
  const auto grow = [&](int at, double density) {
    covariance_.block<3, 3>(at, at) += Matrix3d::Identity() * density * density * dt;
  };
  grow(kRotation, tuning_.gyro_noise);
  grow(kVelocity, tuning_.accel_noise);
  grow(kGyroBias, tuning_.gyro_bias_walk);
  grow(kAccelBias, tuning_.accel_bias_walk);

  // half of the turn for the force, which acts in the middle of the interval
  const Quaterniond halfway = state_.rotation * quaternion_from_rotation_vector(0.5 * w * dt);
  const Vector3d acceleration = halfway * a + state_.gravity;
  state_.position += state_.velocity * dt + 0.5 * acceleration * dt * dt;
  state_.velocity += acceleration * dt;
  state_.rotation = (state_.rotation * quaternion_from_rotation_vector(w * dt)).normalized();
}

/// Through the readings to an instant; remembers the way.
void Odometry::carry_to(SimTime end) {
  way_.assign(1, {time_, state_.pose()});
  while (!readings_.empty() && time_ < end) {
    // a reading holds until the next one
    const SimTime until = readings_.size() > 1 ? std::min(end, readings_[1].time) : end;
    if (until > time_) {
      propagate(readings_.front(), to_seconds(until - time_));
      time_ = until;
      way_.push_back({time_, state_.pose()});
    }
    if (readings_.size() < 2 || readings_[1].time > end) break;
    readings_.pop_front();
  }
}

/// Points as they would have been seen at the end of the scan, in the IMU's frame.
std::vector<Vector3d> Odometry::deskewed(std::span<const LidarPoint> points) const {
  const Pose to_end = way_.back().pose.inverse();
  std::vector<Vector3d> moved;
  moved.reserve(points.size());
  std::size_t stop = 0;
  for (const LidarPoint& point : points) {
    if (point.position.squaredNorm() < kLeastRange * kLeastRange) continue;
    if (way_[stop].time > point.time) stop = 0;
    while (stop + 2 < way_.size() && way_[stop + 1].time <= point.time) ++stop;
    Pose then = way_[stop].pose;
    if (stop + 1 < way_.size()) {
      const double share = to_seconds(point.time - way_[stop].time) /
                           to_seconds(way_[stop + 1].time - way_[stop].time);
      then = interpolate(way_[stop].pose, way_[stop + 1].pose, std::clamp(share, 0.0, 1.0));
    }
    moved.push_back(to_end * (then * (T_imu_lidar_ * point.position)));
  }
  return moved;
}

/// The first point of each cube.
std::vector<Vector3d> Odometry::thinned(const std::vector<Vector3d>& points) const {
  std::set<std::tuple<int, int, int>> taken;
  std::vector<Vector3d> kept;
  for (const Vector3d& p : points) {
    const auto cell = [&](double x) { return static_cast<int>(std::floor(x / tuning_.thinning)); };
    if (taken.emplace(cell(p.x()), cell(p.y()), cell(p.z())).second) kept.push_back(p);
  }
  return kept;
}

/// Iterated Kalman update: the state that fits both what the IMU said and the planes.
void Odometry::correct(const std::vector<Vector3d>& points) {
  const State before = state_;
  const Matrix prior = covariance_.inverse();
  const double weight = 1.0 / (tuning_.point_sigma * tuning_.point_sigma);
  Matrix information = prior;
  for (int i = 0; i < tuning_.iterations; ++i) {
    information = prior;
    Vector gradient = -prior * between(before, state_);
    for (const Vector3d& point : points) {
      const Vector3d world = state_.rotation * point + state_.position;
      const auto plane = map_.plane_at(world);
      if (!plane) continue;
      const double residual = plane->normal.dot(world) - plane->offset;
      // farther points may be farther off
      if (std::abs(residual) > 0.1 * std::sqrt(point.norm())) continue;
      Eigen::Matrix<double, 1, 6> h;
      h << -(plane->normal.transpose() * state_.rotation.toRotationMatrix() * cross(point)),
          plane->normal.transpose();
      information.topLeftCorner<6, 6>() += weight * h.transpose() * h;
      gradient.head<6>() -= weight * h.transpose() * residual;
    }
    const Vector step = information.ldlt().solve(gradient);
    state_ = moved(state_, step);
    if (step.head<3>().norm() < 1e-4 && step.segment<3>(kPosition).norm() < 1e-3) break;
  }
  covariance_ = information.inverse();
}

const State& Odometry::add_scan(std::span<const LidarPoint> points, SimTime end) {
  if (readings_.empty()) return state_;
  if (!started_) {
    // it hovers: what it feels is what holds it against gravity
    Vector3d mean = Vector3d::Zero();
    for (const ImuReading& r : readings_) mean += r.accel / static_cast<double>(readings_.size());
    state_.gravity = -kGravityLength * (state_.rotation * mean).normalized();
    time_ = readings_.front().time;
    started_ = true;
  }
  carry_to(end);
  const std::vector<Vector3d> seen = thinned(deskewed(points));
  if (map_.size() > 0) correct(seen);
  for (const Vector3d& point : seen) map_.add(state_.pose() * point);
  return state_;
}

}  // namespace lio
