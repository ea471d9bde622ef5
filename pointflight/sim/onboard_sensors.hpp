// What every vehicle measures with: odometry, IMU, LiDARs.
#pragma once

#include <memory>
#include <optional>

#include "pointflight/lidar/lidar.hpp"
#include "pointflight/sim/faults.hpp"
#include "pointflight/sim/scenario.hpp"
#include "pointflight/sim/sensor.hpp"

namespace pointflight {

/// Reports where a vehicle is and how it moves, as `EstimateSettings` say, later still where a
/// fault delays it.
class OdometrySource : public InstantSensor {
 public:
  /// The faults must outlive it.
  OdometrySource(double rate,
                 const EstimateSettings& settings,
                 const SensorSite& site,
                 const Faults& faults)
      : InstantSensor(rate), estimator_(settings, rate, site.seed, site.vehicle), faults_(faults) {}
  [[nodiscard]] std::any memory_at_start() const override { return Estimator::Memory{}; }
  [[nodiscard]] bool loses(std::int64_t index) const override { return estimator_.loses(index); }
  [[nodiscard]] Sample measure(const InstantInput& input, std::any& memory) const override;
  void arrive(Sample& sample, const VehicleStatus& status) const override;

 private:
  Estimator estimator_;
  const Faults& faults_;
};

/// The IMU of a vehicle; what is stuck repeats its last value.
class OnboardImu : public InstantSensor {
 public:
  /// The faults must outlive it.
  OnboardImu(const VehicleSettings& vehicle, const SensorSite& site, const Faults& faults)
      : InstantSensor(vehicle.imu.rate), imu_(vehicle, site.seed, site.vehicle), faults_(faults) {}
  [[nodiscard]] std::any memory_at_start() const override { return Memory{}; }
  [[nodiscard]] Sample measure(const InstantInput& input, std::any& memory) const override;

 private:
  struct Memory {
    Imu::Memory imu;                ///< Of the last sample.
    std::optional<ImuSample> last;  ///< What a stuck axis repeats.
  };
  Imu imu_;
  const Faults& faults_;
};

/// A LiDAR on a vehicle. Measurement k covers [at(k), at(k + 1)) of its schedule.
class MountedLidar : public IntervalSensor {
 public:
  /// Of a LiDAR: vehicle << 8 | its number on the vehicle.
  static std::uint32_t entity_of(const SensorSite& site) { return site.vehicle << 8 | site.sensor; }

  /// `mount` of the scenario; `site.sensor`: its number among the vehicle's LiDARs, of which
  /// `lidar` has been told. Map and faults
  /// must outlive it. Throws InputError if it is to mark what the map does not say.
  MountedLidar(const LidarMount& mount,
               Lidar lidar,
               const SensorSite& site,
               std::shared_ptr<const Renderer> renderer,
               const SurfelMap& map,
               const Faults& faults);

  /// Pattern and noise; its number is vehicle << 8 | LiDAR.
  [[nodiscard]] const Lidar& lidar() const { return lidar_; }
  /// The beams of its scan number `index`.
  [[nodiscard]] std::vector<Beam> beams_of(std::uint64_t index, const Executor& executor) const {
    return lidar_.beams(lidar_.pattern_scan(index, site_.seed), executor);
  }
  /// From the sensor's axes to the body's.
  [[nodiscard]] const Pose& T_body_sensor() const { return T_body_sensor_; }

  /// True if all beams of a scan leave from one pose.
  [[nodiscard]] bool takes_snapshots() const { return snapshot_ || renderer_->is_snapshot(); }

  /// What its points say besides.
  [[nodiscard]] ScanMarks marks() const {
    return {known_ != nullptr, lidar_.reports_echoes(), truth_};
  }

  [[nodiscard]] double reach() const override;
  [[nodiscard]] bool sees_own_vehicle() const override { return own_airframe_; }
  [[nodiscard]] bool loses(std::int64_t index) const override;
  [[nodiscard]] const Renderer* renderer() const override { return renderer_.get(); }
  [[nodiscard]] std::unique_ptr<IntervalMeasurement> begin(
      const IntervalInput& input) const override;

 private:
  SensorSite site_;
  Lidar lidar_;
  std::shared_ptr<const Renderer> renderer_;
  Pose T_body_sensor_;
  bool snapshot_;
  bool noise_;
  bool truth_;
  bool own_airframe_;
  const SurfelMap* map_;
  const KnownSpace* known_ = nullptr;  ///< Null: points are not marked.
  const Faults& faults_;
};

}  // namespace pointflight
