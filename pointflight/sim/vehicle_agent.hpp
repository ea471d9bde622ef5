#pragma once

#include <any>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/sim/internal/proximity.hpp"
#include "pointflight/sim/onboard_sensors.hpp"
#include "pointflight/sim/samples.hpp"
#include "pointflight/sim/scenario.hpp"
#include "pointflight/sim/shared_parts.hpp"
#include "pointflight/sim/state_history.hpp"
#include "pointflight/sim/step_samples.hpp"
#include "pointflight/vehicle/autopilot.hpp"
#include "pointflight/vehicle/battery.hpp"
#include "pointflight/vehicle/multirotor.hpp"
#include "pointflight/world/wind.hpp"

namespace pointflight {

/// What happened to a vehicle in a run.
struct VehicleSummary {
  double distance_flown = 0.0;             ///< m
  double speed_max = 0.0;                  ///< m/s
  double tracking_error_rms = 0.0;         ///< Of the position against its command, m.
  double tracking_error_max = 0.0;         ///< m
  std::uint64_t states = 0;                ///< Samples of the truth.
  std::uint64_t imu_samples = 0;           ///< Samples of the IMU.
  std::uint64_t scans = 0;                 ///< Delivered: lost ones do not count.
  std::uint64_t beams = 0;                 ///< Fired in them.
  std::uint64_t points = 0;                ///< Returns in them.
  std::uint64_t collisions = 0;            ///< Times that its hull entered something.
  Duration off_track{0};                   ///< How long it was over 3 m off a way that it flew.
  Duration speed_limited{0};               ///< How long its speed limit cut what was asked for.
  Duration acceleration_limited{0};        ///< The same for the horizontal or climbing one.
  Duration tilt_limited{0};                ///< The same for its greatest tilt.
  Duration rotors_limited{0};              ///< How long the rotors could not give the thrust.
  std::uint64_t beyond_limits = 0;         ///< Trajectories that asked for more than it has.
  std::optional<SimTime> battery_low;      ///< When it came to its reserve.
  std::optional<SimTime> battery_empty;    ///< When its rotors stopped.
  std::optional<SimTime> rotor_lost;       ///< When it began to come down without one.
  std::optional<double> closest_approach;  ///< Of the hull to anything, m; negative inside.
  /// Of the other thing, m; as below, at the closest approach.
  Vector3d closest_position_world = Vector3d::Zero();
  Label closest_label = kMapLabel;  ///< What it came closest to.
};

/// All of a sensor that changes.
struct SensorStatus {
  std::int64_t next = 0;  ///< Index in its schedule.
  std::any memory;        ///< `InstantSensor::memory_at_start`, as it has become.
};

/// A measurement on its way.
struct LateSample {
  std::size_t sensor = 0;  ///< Its number on the vehicle.
  Sample sample;           ///< Not yet `InstantSensor::arrive`d.
};

/// All of a vehicle that changes: a value, so that a run can be saved and branched.
struct VehicleStatus {
  VehicleState state;                  ///< Body and rotors at the present time.
  AutopilotState autopilot;            ///< What it was told, and its memory.
  GustState gusts;                     ///< Unchanged in calm air.
  BatteryState battery;                ///< Unchanged without a battery.
  FlightConditions conditions;         ///< Of the step under way: wind, ground, battery, faults.
  std::vector<double> rotor_commands;  ///< rad/s, held over the step under way.
  StateHistory history;                ///< Poses that scans in arrears still need.
  ProximityState proximity;            ///< What its hull is near to or touches.
  bool landed = false;                 ///< The ground carries it.
  bool crashed = false;                ///< Rotors off for good.
  bool off_track = false;              ///< Far off its way, and not back yet.
  bool commanded = false;              ///< A program has told it something.
  std::vector<VehicleEvent> events;    ///< Not yet delivered.
  std::size_t next_command = 0;        ///< Of the scenario's.
  bool scripted = false;               ///< What it does is the scenario's last command.
  std::int64_t next_state = 0;         ///< Index in the schedule of output.trajectory_rate.
  std::vector<SensorStatus> sensors;   ///< As `VehicleAgent::sensors`.
  std::vector<LateSample> late;        ///< Measured, not yet arrived.
  EstimateError estimate;              ///< Of the odometry that came last.
  double squared_error_sum = 0.0;      ///< Of the tracking error, m^2.
  std::uint64_t steps = 0;             ///< That it was summed over.
  VehicleSummary summary;              ///< What happened so far.
  bool present = true;                 ///< False: flown elsewhere, and not there.
  SimTime present_since = SimTime::min();  ///< Since when it has been there.
  Duration skipped{0};  ///< The scenario's commands come so much later (`Simulation::skip_to`).
};

/// A sensor on a vehicle; one of `instant` and `interval` is not null.
struct MountedSensor {
  const SensorKind* kind;                ///< Null for odometry, IMU and LiDARs.
  std::unique_ptr<const Sensor> sensor;  ///< Never null.
  const InstantSensor* instant;          ///< The same, if it measures at instants.
  const IntervalSensor* interval;        ///< The same, if it takes time.
};

/// One vehicle of a run: everything that does not change, and how its status advances.
class VehicleAgent {
 public:
  /// `number` in the fleet. Throws InputError (unknown models, commands
  /// that it cannot take).
  VehicleAgent(const Scenario& scenario,
               std::size_t number,
               const VehicleSetup& setup,
               SharedParts& shared);

  VehicleAgent(const VehicleAgent&) = delete;  // its sensors know its faults
  VehicleAgent& operator=(const VehicleAgent&) = delete;

  /// Hovering at its start, rotors at hover speed; or landed, rotors still.
  [[nodiscard]] VehicleStatus start() const;

  /// Takes a command; returns why not, if so. A trajectory that is beyond the vehicle is an event.
  std::optional<std::string> command(VehicleStatus& status,
                                     const Command& command,
                                     SimTime now) const;

  /// Takes the scenario's commands that are due, then control: rotor commands, wind, ground,
  /// battery for the step that starts now.
  void control(VehicleStatus& status,
               const SurfelMap& map,
               SimTime now,
               Duration step,
               std::uint64_t step_number) const;

  /// Samples due in [now, end), appended in time's order.
  void sample(VehicleStatus& status, SimTime now, SimTime end, StepSamples& samples) const;

  /// The state a part of the step later.
  [[nodiscard]] VehicleState state_after(const VehicleStatus& status, double dt) const;

  /// Advances by a step; false if the dynamics diverged.
  bool integrate(VehicleStatus& status, double dt) const;

  /// As if it had come to a state at `time` with what the scenario told it until then.
  void resume(VehicleStatus& status, const VehicleState& state, SimTime time) const;

  /// Its sensors begin with their first measurement at or after `time`; what was on its way is
  /// lost.
  void move_schedules_to(VehicleStatus& status, SimTime time) const;

  /// Its hull hit something: what the scenario says happens.
  void crash(VehicleStatus& status) const;

  /// What scans and collisions call it.
  [[nodiscard]] Label label() const { return kFirstVehicle + number_; }
  /// As others see and hit it, standing at the world's origin.
  [[nodiscard]] Body body() const;
  /// Its index in the fleet, from 0.
  [[nodiscard]] std::uint32_t number() const { return number_; }
  /// As the scenario has it, with a name.
  [[nodiscard]] const VehicleSetup& setup() const { return setup_; }
  /// The vehicle file's, with the scenario's limits and controller in place.
  [[nodiscard]] const VehicleSettings& settings() const { return dynamics_.settings(); }
  /// Turns commands into rotor speeds; its state is `VehicleStatus::autopilot`.
  [[nodiscard]] const Autopilot& autopilot() const { return autopilot_; }
  /// Without waypoints: of zero duration, at the start.
  [[nodiscard]] const Mission& mission() const { return *mission_; }
  /// What must not touch anything; around the body's origin, m.
  [[nodiscard]] const Solid& hull() const { return hull_; }
  /// What LiDARs see of it; null: its hull.
  [[nodiscard]] const std::shared_ptr<const Assembly>& look() const { return look_; }
  /// The hull.
  [[nodiscard]] const BodyShape& shape() const { return shape_; }
  /// In the order of the scenario.
  [[nodiscard]] const std::vector<const MountedLidar*>& lidars() const { return lidars_; }
  /// Odometry, IMU, the scenario's own sensors, LiDARs.
  [[nodiscard]] std::span<const MountedSensor> sensors() const { return sensors_; }
  /// What an accelerometer at its origin feels: nothing on the ground.
  [[nodiscard]] BodyAcceleration acceleration(const VehicleStatus& status,
                                              const VehicleState& state) const;
  /// Empty for most.
  [[nodiscard]] const Faults& faults() const { return faults_; }
  /// Of its sensors and gusts: its own, or the run's.
  [[nodiscard]] std::uint64_t seed() const { return seed_; }

  /// What of the scenario's mission and trajectories is beyond the vehicle, a line each.
  [[nodiscard]] std::vector<std::string> foreseen() const;

  /// How long its mission and commands take, s; 0: nothing to do.
  [[nodiscard]] double busy_time() const { return busy_time_; }

  /// What a ray hits on the map; obstacles and vehicles are not looked for.
  [[nodiscard]] Hit look(const Ray& ray) const { return view_->trace(ray); }

 private:
  struct TimedCommand {
    SimTime time;
    Command command;
  };
  void read_commands(const Scenario& scenario);
  /// What its controllers take for its state.
  [[nodiscard]] RigidBodyState believed(const VehicleStatus& status) const;
  void note(VehicleStatus& status, SimTime now, const char* kind, const std::string& words) const;
  void come_down_spinning(VehicleStatus& status, SimTime now) const;
  void watch_limits(VehicleStatus& status, Duration step) const;
  void watch_track(VehicleStatus& status, double error, SimTime now, Duration step) const;
  void watch_battery(VehicleStatus& status, SimTime now) const;
  [[nodiscard]] bool touches_down(const VehicleStatus& status) const;
  [[nodiscard]] double ground_below(const VehicleStatus& status) const;
  void mount_sensors(const Scenario& scenario, SharedParts& shared);
  void mount(const SensorKind* kind, std::unique_ptr<const Sensor> sensor);
  void check_faults(const Scenario& scenario) const;
  [[nodiscard]] SimTime next_instant(const VehicleStatus& status) const;

  std::uint32_t number_;
  VehicleSetup setup_;
  std::uint64_t seed_;
  Multirotor dynamics_;
  Autopilot autopilot_;
  std::uint64_t control_steps_;  ///< Physics steps in a control period.
  Battery battery_;
  Wind wind_;
  Faults faults_;
  Solid hull_;
  BodyShape shape_;
  std::shared_ptr<const Assembly> look_;
  std::shared_ptr<const Mission> mission_;
  std::vector<TimedCommand> commands_;
  std::vector<MountedSensor> sensors_;
  std::vector<const MountedLidar*> lidars_;
  std::shared_ptr<const Renderer> view_;           ///< Of the map, one ray at a time.
  std::shared_ptr<const Renderer> ground_sensor_;  ///< Looks down for ground effect, or none.
  Schedule state_schedule_;
  double busy_time_ = 0.0;
};

}  // namespace pointflight
