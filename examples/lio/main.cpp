// Flies a scenario and runs a small LiDAR-inertial odometry (odometry.hpp) on what its first
// vehicle measures: lio SCENARIO.yaml [--without-times] [-o ESTIMATE.tum]. Prints how far the
// estimate is from the truth in the end. `--without-times` takes all points of a scan as seen at
// its end: what an odometry gives away that does not de-skew.
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <optional>
#include <string>

#include "examples/lio/odometry.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/sim/simulation.hpp"

using namespace pointflight;

namespace {

/// Hands samples to the odometry and keeps the truth beside it.
class Judge : public SampleSink {
 public:
  Judge(const VehicleAgent& vehicle, bool with_times, std::ofstream* output)
      : with_times_(with_times), output_(output) {
    const ImuSettings& imu = vehicle.settings().imu;
    const Vector3d rpy = imu.rotation_rpy_deg * (3.14159265358979323846 / 180.0);
    T_body_imu_ = {quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z()), imu.position};
    T_imu_lidar_ = T_body_imu_.inverse() * vehicle.lidars().at(0)->T_body_sensor();
  }

  void on_sample(const Sample& sample) override {
    if (const auto* state = std::get_if<StateSample>(&sample); state && state->vehicle == 0) {
      take_truth(*state);
    } else if (const auto* imu = std::get_if<ImuSample>(&sample); imu && imu->vehicle == 0) {
      if (odometry_) odometry_->add({imu->stamp, imu->gyro, imu->accel});
    } else if (const auto* scan = std::get_if<ScanSample>(&sample);
               scan && scan->scan->vehicle == 0 && scan->scan->sensor == 0) {
      take_scan(*scan->scan);
    }
  }

  void report() const {
    std::printf(
        "%.1f m flown, %.2f rad/s at most; estimate off by %.3f m in the end (%.2f %% of the "
        "way), %.3f m at most; %zu points in its map\n",
        way_,
        fastest_turn_,
        last_error_,
        way_ > 0.0 ? 100.0 * last_error_ / way_ : 0.0,
        worst_error_,
        odometry_ ? odometry_->map().size() : std::size_t{0});
  }

 private:
  void take_truth(const StateSample& sample) {
    const Pose pose = sample.state.body.T_world_body() * T_body_imu_;
    if (!odometry_) odometry_.emplace(pose, T_imu_lidar_);
    if (!truth_.empty()) way_ += (pose.translation - truth_.back().pose.translation).norm();
    fastest_turn_ = std::max(fastest_turn_, sample.state.body.omega_body.norm());
    if (truth_.size() > 400) truth_.erase(truth_.begin(), truth_.begin() + 200);  // of seconds ago
    truth_.push_back({sample.time, pose});
  }

  void take_scan(const Scan& scan) {
    if (!odometry_) return;
    std::vector<lio::LidarPoint> points;
    points.reserve(scan.points.size());
    for (const ScanPoint& p : scan.points) {
      points.push_back(
          {with_times_ ? scan.seen_at(p) : scan.end, p.position_sensor.cast<double>()});
    }
    const lio::State& state = odometry_->add_scan(points, scan.end);
    const PoseTrack track(truth_);
    last_error_ = (state.position - track.at(scan.end).translation).norm();
    worst_error_ = std::max(worst_error_, last_error_);
    if (output_ == nullptr) return;
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
    *output_ << row;
  }

  bool with_times_;
  std::ofstream* output_;
  Pose T_body_imu_, T_imu_lidar_;
  std::optional<lio::Odometry> odometry_;
  std::vector<TimedPose> truth_;
  double way_ = 0.0, fastest_turn_ = 0.0, last_error_ = 0.0, worst_error_ = 0.0;
};

}  // namespace

int main(int count, char** words) try {
  std::string path;
  std::optional<std::ofstream> output;
  bool with_times = true;
  for (int i = 1; i < count; ++i) {
    if (std::strcmp(words[i], "--without-times") == 0) {
      with_times = false;
    } else if (std::strcmp(words[i], "-o") == 0 && i + 1 < count) {
      output.emplace(words[++i]);
      if (!*output) throw InputError(std::string(words[i]) + ": cannot be written");
    } else if (words[i][0] != '-' && path.empty()) {
      path = words[i];
    } else {
      throw InputError("usage: lio SCENARIO.yaml [--without-times] [-o ESTIMATE.tum]");
    }
  }
  if (path.empty())
    throw InputError("usage: lio SCENARIO.yaml [--without-times] [-o ESTIMATE.tum]");
  const Scenario scenario = load_scenario(path);
  if (scenario.fleet().front().lidars.empty()) {
    throw InputError(path + ": the first vehicle has no LiDAR");
  }
  const Executor executor;
  Simulation simulation(scenario, scenario.open_map(), executor);
  Judge judge(simulation.vehicle(0), with_times, output ? &*output : nullptr);
  while (simulation.step(judge)) {
  }
  judge.report();
  return simulation.end() == RunEnd::kCompleted ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
