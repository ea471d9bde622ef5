#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/render/renderer.hpp"
#include "pointflight/sim/scenario.hpp"
#include "pointflight/sim/state_history.hpp"
#include "pointflight/vehicle/controller.hpp"
#include "pointflight/vehicle/imu.hpp"
#include "pointflight/vehicle/multirotor.hpp"
#include "pointflight/world/clearance.hpp"

namespace pointflight {

/// Truth at an instant.
struct StateSample {
  SimTime time;
  VehicleState state;
  PositionCommand command;
  std::optional<double> clearance;  ///< m; nothing within `Simulation::kClearanceReach`.
};

/// The vehicle's sphere met the map, or left it again.
struct CollisionEvent {
  SimTime time;
  bool entered = true;
  Vector3d vehicle_world = Vector3d::Zero();
  Vector3d place_world = Vector3d::Zero();  ///< What it met.
  double penetration = 0.0;                 ///< m
};

/// Where the samples of a run go. Called in the order of their times, from one thread.
class SampleSink {
 public:
  virtual ~SampleSink() = default;
  virtual void on_state(const StateSample& /*sample*/) {}
  virtual void on_imu(const ImuSample& /*sample*/) {}
  /// `pose_at` gives T_world_sensor during the scan.
  virtual void on_scan(const Scan& /*scan*/, const PoseAt& /*pose_at*/) {}
  virtual void on_collision(const CollisionEvent& /*event*/) {}
};

enum class RunEnd { kRunning, kCompleted, kMissionUnfinished, kCollision, kInterrupted };
const char* to_string(RunEnd end);

/// What happened in a run. Holds nothing of the wall clock.
struct RunSummary {
  RunEnd end = RunEnd::kRunning;
  SimTime time;
  double distance_flown = 0.0;      ///< m
  double speed_max = 0.0;           ///< m/s
  double tracking_error_rms = 0.0;  ///< Of the position against its command, m.
  double tracking_error_max = 0.0;
  std::uint64_t states = 0;
  std::uint64_t imu_samples = 0;
  std::uint64_t scans = 0;
  std::uint64_t beams = 0;
  std::uint64_t points = 0;
  std::uint64_t collisions = 0;
  std::optional<double> closest_approach;  ///< Of the sphere to the map, m; negative inside.
  Vector3d closest_place_world = Vector3d::Zero();
};

/// The deterministic loop: control, sense, integrate. A function of scenario and map; threads, wall
/// clock and sinks change nothing.
class Simulation {
 public:
  /// Clearance is known up to here, m.
  static constexpr double kClearanceReach = 10.0;

  /// Throws InputError where the scenario cannot be flown (unknown models, start inside the map).
  Simulation(const Scenario& scenario,
             std::shared_ptr<const SurfelMap> map,
             const Executor& executor);
  ~Simulation();

  /// One physics step; samples that fall due go to `sink`. False when the run has ended.
  bool step(SampleSink& sink);

  /// Ends the run early.
  void interrupt();

  [[nodiscard]] SimTime time() const { return time_; }
  [[nodiscard]] SimTime end_time() const { return end_time_; }
  [[nodiscard]] const VehicleState& state() const { return state_; }
  [[nodiscard]] const Mission& mission() const { return mission_; }
  [[nodiscard]] const Scenario& scenario() const { return scenario_; }
  [[nodiscard]] const VehicleSettings& vehicle() const { return dynamics_.settings(); }
  [[nodiscard]] const RunSummary& summary() const { return summary_; }

 private:
  struct MountedLidar;

  void check_start();
  void sense_clearance(SampleSink& sink);
  void sample_until(SimTime end, SampleSink& sink);
  void take_due_scans(SimTime known, SampleSink& sink);
  void take_scan(MountedLidar& mounted, SampleSink& sink);
  [[nodiscard]] bool passed_through() const;
  void finish(RunEnd end);
  [[nodiscard]] VehicleState state_at(SimTime time) const;

  Scenario scenario_;
  std::shared_ptr<const SurfelMap> map_;
  const Executor& executor_;
  Multirotor dynamics_;
  std::unique_ptr<Controller> controller_;
  Imu imu_;
  Mission mission_;
  std::vector<MountedLidar> lidars_;
  StateHistory history_;

  Duration step_;
  SimTime time_;
  SimTime end_time_;
  VehicleState state_;
  PositionCommand command_;
  std::vector<double> rotor_commands_;
  std::optional<Clearance> clearance_;
  std::optional<Vector3d> previous_p_world_;
  bool colliding_ = false;
  Schedule state_schedule_;
  Schedule imu_schedule_;
  std::int64_t next_state_ = 0;
  std::int64_t next_imu_ = 0;
  double squared_error_sum_ = 0.0;
  std::uint64_t steps_ = 0;
  RunSummary summary_;
};

}  // namespace pointflight
