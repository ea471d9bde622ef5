// The samples that a run emits. Each is self-contained, so that it can be kept, queued, stored and
// sent.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "pointflight/lidar/lidar.hpp"
#include "pointflight/vehicle/command.hpp"
#include "pointflight/vehicle/estimate.hpp"
#include "pointflight/vehicle/imu.hpp"
#include "pointflight/vehicle/state.hpp"
#include "pointflight/world/contact.hpp"

namespace pointflight {

/// Truth at an instant, at output.trajectory_rate, the state at time zero first.
struct StateSample {
  std::uint32_t vehicle = 0;       ///< Number in the fleet, from 0.
  SimTime time;                    ///< Of the state: a multiple of 1 / output.trajectory_rate.
  VehicleState state;              ///< Body and rotors, without any measurement error.
  PositionCommand command;         ///< What the autopilot asked for; parts may be the state's own.
  std::optional<Contact> nearest;  ///< Nothing within `Simulation::kClearanceReach`.
  Duration skipped{0};             ///< Of the run's time until then, jumped over.
};

/// What an odometry source on board reports at output.odometry_rate: the truth, or what it takes
/// for it (`EstimateSettings`), possibly late.
struct OdometrySample {
  std::uint32_t vehicle = 0;           ///< Number in the fleet, from 0.
  SimTime time;                        ///< Of the state.
  SimTime delivered;                   ///< When it arrives; `time` or later.
  RigidBodyState state;                ///< At `time`, as it is reported.
  RigidBodyState truth;                ///< At `time`.
  EstimateError error;                 ///< That parts them.
  EstimateVariance variance;           ///< That the source states, true to its errors.
  std::vector<double> rotor_commands;  ///< When it is delivered, rad/s.
};

/// One scan of a LiDAR, delivered when all its beams are known.
struct ScanSample {
  std::shared_ptr<const Scan> scan;  ///< Never null; names vehicle and sensor.
  PoseTrack T_world_sensor;          ///< Where the sensor was from its start to its end.
};

/// A measurement of any other sensor: barometer, GNSS and so on, or a kind that a program has added
/// (`SensorKind`).
struct Measurement {
  std::uint32_t vehicle = 0;   ///< Number in the fleet, from 0.
  std::uint32_t sensor = 0;    ///< Number in `VehicleAgent::sensors`.
  SimTime time;                ///< When it was measured.
  SimTime delivered;           ///< When it arrives; `time` or later.
  std::vector<double> values;  ///< As the kind's columns say.
};

/// A vehicle's hull hit something, or left it again; said in the step in which it did.
struct CollisionEvent {
  std::uint32_t vehicle = 0;  ///< Number in the fleet, from 0.
  Label partner = kMapLabel;  ///< What it hit: the map, another vehicle or an obstacle.
  SimTime time;               ///< Within the step, if it was found.
  bool entered = true;        ///< False: it came free again.
  Vector3d vehicle_world = Vector3d::Zero();   ///< The body's origin, m.
  Vector3d position_world = Vector3d::Zero();  ///< Where it hit.
  double penetration = 0.0;                    ///< At the end of the step, m.
};

/// Something that happened on board a vehicle: batteries, demands beyond limits.
struct VehicleEvent {
  std::uint32_t vehicle = 0;  ///< Number in the fleet, from 0.
  SimTime time;               ///< Of the step that it was noticed in.
  /// "off_track", "battery_low", "battery_empty", "rotor_lost", "beyond_limits"; of shared runs
  /// "lost", "back", "left", "missed_contact".
  std::string kind;
  std::string words;                          ///< One line for users.
  Vector3d vehicle_world = Vector3d::Zero();  ///< The body's origin, m.
  std::optional<Label> partner;               ///< What it is about besides the vehicle.
  double penetration = 0.0;                   ///< m, with a partner that was hit.
};

/// An obstacle at an instant.
struct PlacedObstacle {
  /// `kFirstObstacle` + its number; what replaces an obstacle has the same.
  Label label = kMapLabel;
  Pose T_world_body;  ///< Of its own frame; a cloud's origin need not be its middle.
  BodyShape shape;    ///< In its own frame.
};

/// Where all obstacles are that are there, at output.obstacle_rate; none without any.
struct ObstacleSample {
  SimTime time;                           ///< A multiple of 1 / output.obstacle_rate.
  std::vector<PlacedObstacle> obstacles;  ///< By label.
};

/// How a vehicle fares, at `Simulation::kStatusRate`, at the end of the step that comes to it.
struct StatusSample {
  std::uint32_t vehicle = 0;        ///< Number in the fleet, from 0.
  SimTime time;                     ///< Of the state; a step's end.
  RigidBodyState state;             ///< The true one.
  bool crashed = false;             ///< Rotors off for good.
  bool landed = false;              ///< The ground carries it.
  bool touches = false;             ///< Its hull is in contact with something.
  bool armed = true;                ///< Its rotors may turn.
  std::string command;              ///< What it was told last, in a word.
  std::optional<double> clearance;  ///< m; nothing within `Simulation::kClearanceReach`.
  std::uint64_t collisions = 0;     ///< So far.
  std::uint64_t scans = 0;          ///< Delivered so far.
  std::uint64_t rejected = 0;       ///< Commands that it did not take.
  std::string last_rejection;       ///< Why; empty if it took all.
  std::uint64_t timeouts = 0;       ///< Times that commands stopped coming.
};

/// Anything that a run says.
using Sample = std::variant<StateSample,
                            OdometrySample,
                            ImuSample,
                            Measurement,
                            ScanSample,
                            CollisionEvent,
                            VehicleEvent,
                            ObstacleSample,
                            StatusSample>;

/// Calls the one of several functions that takes what a variant holds; for `std::visit`.
template <class... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};
/// Of functions as they are given.
template <class... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;

/// Where the samples of a run go. Called from one thread, by time: within a step first what
/// happened, then truth and measurements as they arrive, then obstacles, then scans that have
/// ended, then statuses. Those who want one kind only ask for it: `if (auto* scan =
/// std::get_if<ScanSample>(&sample))`.
class SampleSink {
 public:
  virtual ~SampleSink() = default;
  /// Copies of a sample share its points and tracks.
  virtual void on_sample(const Sample& sample) = 0;
};

/// Calls a function for each sample.
template <class Function>
class SampleFunction : public SampleSink {
 public:
  /// `function(const Sample&)`
  explicit SampleFunction(Function function) : function_(std::move(function)) {}
  void on_sample(const Sample& sample) override { function_(sample); }

 private:
  Function function_;
};

/// Passes samples on to several sinks, in the order in which they were added; to nobody at first.
class SampleSplitter : public SampleSink {
 public:
  /// The sink must outlive the splitter.
  void add(SampleSink& sink) { sinks_.push_back(&sink); }
  void on_sample(const Sample& sample) override {
    for (SampleSink* sink : sinks_) sink->on_sample(sample);
  }

 private:
  std::vector<SampleSink*> sinks_;
};

}  // namespace pointflight
