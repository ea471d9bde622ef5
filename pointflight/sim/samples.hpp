#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/lidar/lidar.hpp"
#include "pointflight/vehicle/command.hpp"
#include "pointflight/vehicle/imu.hpp"
#include "pointflight/vehicle/state.hpp"
#include "pointflight/world/contact.hpp"

namespace pointflight {

/// Truth at an instant.
struct StateSample {
  std::uint32_t vehicle = 0;       ///< Number in the fleet, from 0.
  SimTime time;                    ///< Of the state: a multiple of 1 / output.trajectory_rate.
  VehicleState state;              ///< Body and rotors, without any measurement error.
  PositionCommand command;         ///< What the autopilot asked for; parts may be the state's own.
  std::optional<Contact> nearest;  ///< Nothing within `Simulation::kClearanceReach`.
};

/// What an odometry source on board reports: the truth, possibly late.
struct OdometrySample {
  std::uint32_t vehicle = 0;  ///< Number in the fleet, from 0.
  SimTime time;               ///< Of the state.
  SimTime delivered;          ///< When it arrives; later than `time` where a fault delays it.
  RigidBodyState state;       ///< The true one at `time`.
};

/// A vehicle's hull met something, or left it again.
struct CollisionEvent {
  std::uint32_t vehicle = 0;  ///< Number in the fleet, from 0.
  Label partner = kMapLabel;  ///< What it met: the map, another vehicle or an obstacle.
  SimTime time;               ///< Within the step, where it was found.
  bool entered = true;        ///< False: it came free again.
  Vector3d vehicle_world = Vector3d::Zero();  ///< The body's origin, m.
  Vector3d place_world = Vector3d::Zero();    ///< Where it met.
  double penetration = 0.0;                   ///< At the end of the step, m.
};

/// Something that happened on board a vehicle.
struct VehicleEvent {
  std::uint32_t vehicle = 0;  ///< Number in the fleet, from 0.
  SimTime time;               ///< Of the step that it was noticed in.
  std::string kind;           ///< "battery_low", "battery_empty" or "beyond_limits".
  std::string words;          ///< One line for users.
  Vector3d vehicle_world = Vector3d::Zero();  ///< The body's origin, m.
};

/// Where obstacles are, for records.
struct ObstacleSample {
  SimTime time;  ///< A multiple of 1 / output.obstacle_rate.
  /// `kFirstObstacle` + its number; what replaces an obstacle has the same.
  Label label = kMapLabel;
  Pose T_world_body;  ///< Of its own frame; a cloud's origin need not be its middle.
  Vector3d half_extent = Vector3d::Zero();  ///< Of its box, m; zero for points.
};

/// Where the samples of a run go. Called from one thread; states, odometry and IMU in the order
/// (time, kind, vehicle), scans when all their beams are known.
class SampleSink {
 public:
  virtual ~SampleSink() = default;
  /// Truth, at output.trajectory_rate, the state at time zero first.
  virtual void on_state(const StateSample& /*sample*/) {}
  /// What is delivered now, at output.odometry_rate; `sample.time` lies before where it is late.
  virtual void on_odometry(const OdometrySample& /*sample*/) {}
  /// One sample of the vehicle's IMU, at the rate of the vehicle file.
  virtual void on_imu(std::uint32_t /*vehicle*/, const ImuSample& /*sample*/) {}
  /// `pose_at` gives T_world_sensor during the scan.
  virtual void on_scan(const Scan& /*scan*/, const PoseAt& /*pose_at*/) {}
  /// A hull entered or left something; called in the step in which it did.
  virtual void on_collision(const CollisionEvent& /*event*/) {}
  /// Batteries and demands beyond limits.
  virtual void on_vehicle_event(const VehicleEvent& /*event*/) {}
  /// Each obstacle that is there, at output.obstacle_rate.
  virtual void on_obstacle(const ObstacleSample& /*sample*/) {}
};

/// Passes samples on to several sinks, in the order in which they were added.
class SampleSplitter : public SampleSink {
 public:
  /// The sink must outlive the splitter.
  void add(SampleSink& sink) { sinks_.push_back(&sink); }

  void on_state(const StateSample& sample) override {
    for (SampleSink* sink : sinks_) sink->on_state(sample);
  }
  void on_odometry(const OdometrySample& sample) override {
    for (SampleSink* sink : sinks_) sink->on_odometry(sample);
  }
  void on_imu(std::uint32_t vehicle, const ImuSample& sample) override {
    for (SampleSink* sink : sinks_) sink->on_imu(vehicle, sample);
  }
  void on_scan(const Scan& scan, const PoseAt& pose_at) override {
    for (SampleSink* sink : sinks_) sink->on_scan(scan, pose_at);
  }
  void on_collision(const CollisionEvent& event) override {
    for (SampleSink* sink : sinks_) sink->on_collision(event);
  }
  void on_vehicle_event(const VehicleEvent& event) override {
    for (SampleSink* sink : sinks_) sink->on_vehicle_event(event);
  }
  void on_obstacle(const ObstacleSample& sample) override {
    for (SampleSink* sink : sinks_) sink->on_obstacle(sample);
  }

 private:
  std::vector<SampleSink*> sinks_;
};

}  // namespace pointflight
