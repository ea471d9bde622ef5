#include "examples/lio/judge.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <ostream>

#include "pointflight/geometry/rotation.hpp"

namespace lio {

using namespace pointflight;

Judge::Judge(const VehicleAgent& vehicle,
             bool with_times,
             std::ostream* estimate,
             const Tuning& tuning)
    : with_times_(with_times), estimate_(estimate), tuning_(tuning) {
  const ImuSettings& imu = vehicle.settings().imu;
  const Vector3d rpy = imu.rotation_rpy_deg * (std::numbers::pi / 180.0);
  T_body_imu_ = {quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z()), imu.position};
  T_imu_lidar_ = T_body_imu_.inverse() * vehicle.lidars().at(0)->T_body_sensor();
}

void Judge::on_sample(const Sample& sample) {
  if (const auto* state = std::get_if<StateSample>(&sample); state && state->vehicle == 0) {
    take(*state);
  } else if (const auto* imu = std::get_if<ImuSample>(&sample); imu && imu->vehicle == 0) {
    if (odometry_) odometry_->add({imu->stamp, imu->gyro, imu->accel});
  } else if (const auto* scan = std::get_if<ScanSample>(&sample);
             scan && scan->scan->vehicle == 0 && scan->scan->sensor == 0) {
    take(*scan);
  }
}

void Judge::take(const StateSample& sample) {
  const RigidBodyState& body = sample.state.body;
  if (!odometry_) odometry_.emplace(body.T_world_body() * T_body_imu_, T_imu_lidar_, tuning_);
  if (last_place_) way_ += (body.p_world - *last_place_).norm();
  last_place_ = body.p_world;
  fastest_turn_ = std::max(fastest_turn_, body.omega_body.norm());
}

void Judge::take(const ScanSample& sample) {
  if (!odometry_) return;
  const Scan& scan = *sample.scan;
  std::vector<LidarPoint> points;
  points.reserve(scan.points.size());
  for (const ScanPoint& p : scan.points) {
    points.push_back({with_times_ ? scan.seen_at(p) : scan.end, p.position_sensor.cast<double>()});
  }
  const State& state = odometry_->add_scan(points, scan.end);
  const Pose truth = sample.T_world_sensor.at(scan.end) * T_imu_lidar_.inverse();
  last_error_ = (state.position - truth.translation).norm();
  worst_error_ = std::max(worst_error_, last_error_);
  squares_ += last_error_ * last_error_;
  scans_ += 1.0;
  if (estimate_ == nullptr) return;
  const Quaterniond& q = state.rotation;
  char row[256];
  std::snprintf(row,
                sizeof row,
                "%.6f %.4f %.4f %.4f %.6f %.6f %.6f %.6f\n",
                to_seconds(scan.end.time_since_epoch()),
                state.position.x(),
                state.position.y(),
                state.position.z(),
                q.x(),
                q.y(),
                q.z(),
                q.w());
  *estimate_ << row;
}

double Judge::rms_error() const {
  return scans_ > 0.0 ? std::sqrt(squares_ / scans_) : 0.0;
}

std::size_t Judge::map_points() const {
  return odometry_ ? odometry_->map().size() : 0;
}

}  // namespace lio
