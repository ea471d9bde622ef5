#include "pointflight/sim/onboard_sensors.hpp"

#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/sim/vehicle_agent.hpp"

namespace pointflight {

Sample OdometrySource::measure(const InstantInput& input, std::any& memory) const {
  OdometrySample sample;
  sample.vehicle = input.vehicle.number();
  sample.time = input.time;
  const EstimateSettings& settings = estimator_.settings();
  sample.delivered =
      input.time + from_seconds(settings.latency) + faults_.odometry_delay(input.time);
  sample.state = sample.truth = input.state.body;
  if (settings.is_true()) return sample;
  auto& remembered = *std::any_cast<Estimator::Memory>(&memory);
  sample.error = estimator_.error(input.index, remembered);
  sample.variance = estimator_.variance(remembered);
  sample.state = sample.error.on(sample.truth);
  return sample;
}

void OdometrySource::arrive(Sample& sample, const VehicleStatus& status) const {
  std::get<OdometrySample>(sample).rotor_commands = status.rotor_commands;
}

Sample OnboardImu::measure(const InstantInput& input, std::any& memory) const {
  auto& [remembered, last] = *std::any_cast<Memory>(&memory);
  const BodyAcceleration acceleration = input.vehicle.acceleration(input.status, input.state);
  ImuSample sample = imu_.sample(input.index, input.time, input.state, acceleration, remembered);
  for (std::size_t axis = 0; axis < 6 && last && faults_.any(); ++axis) {
    if (!faults_.is_stuck(axis, input.time)) continue;
    const int i = static_cast<int>(axis % 3);
    if (axis < 3) {
      sample.gyro[i] = last->gyro[i];
    } else {
      sample.accel[i] = last->accel[i];
    }
  }
  last = sample;
  return sample;
}

namespace {

/// A scan of a LiDAR on a vehicle.
class ScanUnderWay : public IntervalMeasurement {
 public:
  ScanUnderWay(std::unique_ptr<Exposure> exposure, PoseTrack track, const SensorSite& site)
      : exposure_(std::move(exposure)), T_world_sensor_(std::move(track)), site_(site) {}

  std::optional<RenderJob> job() override { return exposure_->job(); }
  Sample finish(const Executor& executor) override {
    auto scan = std::make_shared<Scan>(exposure_->finish(executor));
    scan->vehicle = site_.vehicle;
    scan->sensor = site_.sensor;
    return ScanSample{std::move(scan), T_world_sensor_};
  }

 private:
  std::unique_ptr<Exposure> exposure_;
  PoseTrack T_world_sensor_;
  SensorSite site_;
};

}  // namespace

MountedLidar::MountedLidar(const LidarMount& mount,
                           Lidar lidar,
                           const SensorSite& site,
                           std::shared_ptr<const Renderer> renderer,
                           const SurfelMap& map,
                           const Faults& faults)
    : IntervalSensor(lidar.settings().rate),
      site_(site),
      lidar_(std::move(lidar)),
      renderer_(std::move(renderer)),
      snapshot_(mount.snapshot),
      noise_(mount.noise),
      truth_(mount.truth),
      own_airframe_(mount.own_airframe),
      map_(&map),
      known_(mount.mark_unknown ? &known_space_of(map) : nullptr),
      faults_(faults) {
  const Vector3d rpy = mount.rotation_rpy_deg * kDegree;
  T_body_sensor_ = {quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z()), mount.position};
}

double MountedLidar::reach() const {
  return lidar_.reach() + T_body_sensor_.translation.norm();
}

bool MountedLidar::loses(std::int64_t index) const {
  const SimTime start = schedule().at(index);
  if (faults_.is_dead(site_.sensor, start)) return true;
  const double lost = faults_.dropped_share(site_.sensor, start);
  const RandomStream chance(site_.seed, StreamId::kDroppedScans, entity_of(site_));
  return lost > 0.0 && chance.uniform(static_cast<std::uint64_t>(index)) < lost;
}

std::unique_ptr<IntervalMeasurement> MountedLidar::begin(const IntervalInput& input) const {
  ScanRequest request;
  request.index = static_cast<std::uint64_t>(input.index);
  request.start = input.start;
  request.snapshot = snapshot_;
  request.noise = noise_;
  request.known = known_;
  request.map = map_;
  request.truth = truth_;
  request.seed = site_.seed;
  request.bodies = input.bodies;
  const PoseTrack track = input.T_world_body.with_mount(T_body_sensor_);
  return std::make_unique<ScanUnderWay>(
      lidar_.aim(request, track, *renderer_, input.executor), track, site_);
}

}  // namespace pointflight
