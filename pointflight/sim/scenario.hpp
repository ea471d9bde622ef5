#pragma once

#include <any>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/settings.hpp"
#include "pointflight/core/time.hpp"
#include "pointflight/lidar/return_model.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/scenes/world_map.hpp"
#include "pointflight/sim/command_script.hpp"
#include "pointflight/sim/faults.hpp"
#include "pointflight/sim/scenario_section.hpp"
#include "pointflight/sim/sensor.hpp"
#include "pointflight/vehicle/estimate.hpp"
#include "pointflight/vehicle/mission.hpp"
#include "pointflight/world/obstacles.hpp"
#include "pointflight/world/wind.hpp"

namespace pointflight {

/// What it is if the duration ends with a mission unfinished.
enum class Unfinished {
  kFailure,  ///< `RunEnd::kMissionUnfinished`
  kTimeUp    ///< `RunEnd::kTimeUp`, unless a vehicle has crashed.
};

/// What a scenario may ask for, s; and how far a program can jump ahead.
inline constexpr double kLongestRun = 1e6;

/// A LiDAR on a vehicle: one entry of `lidars`.
struct LidarMount {
  std::string model = "mid360";                  ///< Name or path of a sensor file.
  Vector3d position = Vector3d(0.0, 0.0, 0.1);   ///< m, body frame.
  Vector3d rotation_rpy_deg = Vector3d::Zero();  ///< Of the sensor's axes in the body.
  Choice<RendererKind> renderer{};               ///< "beam", "paper" or an own one.
  bool snapshot = false;                         ///< One pose per scan, as in the paper.
  bool noise = true;                             ///< Of ranges and directions.
  std::int64_t sub_rays = -1;                    ///< `OpticsSettings::sub_rays`; -1: the file's.
  /// CSV of directions that the vehicle blocks (`LidarSettings::blocked`); empty: the file's.
  std::string blocked{};
  bool mark_unknown = false;  ///< Points say whether they came through space no survey saw.
  bool own_airframe = false;  ///< It sees the vehicle that carries it.
  bool truth = false;         ///< Its files say `PointTruth` of each point.
};

/// Limits of the vehicle file that a scenario tightens or widens; 0: the file's.
struct LimitSetup {
  double speed_max = 0.0;               ///< m/s
  double acceleration_max = 0.0;        ///< Horizontal, m/s^2.
  double climb_acceleration_max = 0.0;  ///< m/s^2
  double tilt_max_deg = 0.0;            ///< Greatest tilt.
  double body_rate_max = 0.0;           ///< rad/s
};

/// What a vehicle does that hit something.
enum class CollisionReaction {
  kReport,  ///< Flies on; it is said.
  kStop,    ///< Ends the run.
  kCrash,   ///< Falls, rotors off.
};

/// What a vehicle does at its battery's reserve.
enum class LowBatteryReaction {
  kLand,    ///< Lands and takes no more commands.
  kFall,    ///< Its rotors stop.
  kReport,  ///< Flies on until it is empty.
};

/// What a vehicle's autopilot and controllers take for its state.
enum class ControllerInput {
  kTruth,     ///< What it is.
  kOdometry,  ///< The truth as far off as the odometry that came last was.
};

/// Who flies a vehicle.
enum class AutopilotKind {
  kOwn,        ///< Our autopilot.
  kPx4,        ///< PX4's firmware beside the program (`Px4Link`).
  kArduPilot,  ///< ArduPilot's (`ArduPilotLink`).
};

/// How a firmware flies a vehicle: what links of a run go by.
struct AutopilotSetup {
  AutopilotKind kind = AutopilotKind::kOwn;  ///< Who flies it.
  std::int64_t instance = -1;  ///< Of the firmware: its ports; -1: the vehicle's number.
  bool vision = false;         ///< It gets odometry (PX4: external vision).
  bool obstacles = false;      ///< It gets what the first LiDAR sees, by direction.
  double wait = 10.0;          ///< For an answer, s; then the run goes on without.
};

/// One vehicle, or several alike.
struct VehicleSetup {
  std::string name;                   ///< Of its files and topics; empty: "drone<number>".
  std::string model = "quad_330";     ///< Name or path of a vehicle file.
  Vector3d start = Vector3d::Zero();  ///< Of the body's origin, world, m.
  double start_yaw_deg = 0.0;         ///< Heading at first, from world x towards y.
  bool landed = false;                ///< Starts with rotors off, carried by the ground.
  std::int64_t copies = 1;            ///< So many alike, each with its own number.
  Vector3d copy_offset =
      Vector3d(0.0, 2.0, 0.0);  ///< Of start and waypoints, from copy to copy, m.
  std::int64_t seed = -1;       ///< Of its sensors and gusts; -1: the run's.
  CollisionReaction on_collision = CollisionReaction::kReport;  ///< What it does then.
  std::optional<Choice<ControllerKind>> controller;             ///< Instead of its file's.
  AutopilotSetup autopilot;                                     ///< Who flies it.
  double imu_rate = 0.0;                                        ///< Of its IMU, Hz; 0: the file's.
  /// Of its controllers, s, whole physics steps, over which rotor commands are held; 0: each step.
  double control_period = 0.0;
  double command_timeout = 0.5;                                   ///< s; 0: commands hold for ever.
  bool battery = false;                                           ///< Fly on the vehicle's battery.
  LowBatteryReaction on_low_battery = LowBatteryReaction::kLand;  ///< At its reserve.
  EstimateSettings odometry;                                      ///< How its odometry errs.
  ControllerInput controller_input = ControllerInput::kTruth;     ///< Where it takes itself to be.
  LimitSetup limits;                                ///< Tightened or widened for this vehicle.
  std::vector<LidarMount> lidars = {LidarMount{}};  ///< One is mounted if the file says nothing.
  std::vector<SensorSetup> sensors;                 ///< Besides LiDARs, odometry and IMU.
  MissionSettings mission;                          ///< Without waypoints it hovers at its start.
  std::vector<CommandSettings> commands;            ///< By time; the mission comes first, at 0 s.
  std::vector<FaultSettings> faults;                ///< What fails on board, and when.
};

/// The air.
struct AirSetup {
  WindSettings wind;          ///< Mean wind and gusts.
  bool ground_effect = true;  ///< Where the vehicle's file has its propellers' radius.
};

/// What a flight writes (`FlightRecorder`) and how often samples come.
struct OutputSetup {
  double trajectory_rate = 200.0;  ///< Hz
  bool scans = true;               ///< PCD files; scans are taken in any case.
  bool imu = true;                 ///< imu.csv
  bool odometry = false;           ///< odometry.csv
  double odometry_rate = 200.0;    ///< Hz
  double obstacle_rate = 10.0;     ///< Hz
};

/// A run: what a scenario file says.
struct Scenario {
  std::string path;  ///< Of the file; relative paths in it are taken from its folder.
  std::map<std::string, int> lines;  ///< Line of each key, for messages.
  std::string map;                   ///< Path of the .pfmap, as the file has it.
  /// The made-up world that is flown in instead of a file; `map` is empty then.
  std::optional<WorldMapOptions> world;
  std::string map_hash;   ///< Of the map it was flown in (SurfelMap::hash); empty: any will do.
  std::int64_t seed = 1;  ///< Of everything random.
  double duration = 0.0;  ///< s; 0: as long as the mission takes.
  Unfinished unfinished = Unfinished::kFailure;  ///< At the end of the duration.
  double physics_step = 0.001;                   ///< s
  /// Before copies are written out: `fleet`.
  std::vector<VehicleSetup> vehicles = {VehicleSetup{}};
  bool is_short =
      false;  ///< The file is for one vehicle: `vehicle`, `lidars`, `mission`, ... on top.
  std::vector<ObstacleSettings> obstacles;  ///< What moves by itself.
  AirSetup air;                             ///< Wind and ground effect.
  Surroundings surroundings;                ///< What LiDARs' returns depend on.
  EarthOrigin origin;                       ///< Of the world, for barometers and GNSS.
  OutputSetup output;                       ///< What is written.
  /// What other floors and programs read (`scenario_sections`), by name.
  std::map<std::string, std::any> sections;
  /// YAML of `ros` and `share`, by name, in a program that does not read them.
  std::map<std::string, std::string> sections_as_is;

  /// Of the file: what relative paths are taken from. Empty for a scenario made by a program, which
  /// stands for the working folder.
  [[nodiscard]] std::string folder() const;

  /// The vehicles with their copies written out, each with a name. Keys of number i in messages:
  /// `vehicle_key`.
  [[nodiscard]] std::vector<VehicleSetup> fleet() const;

  /// "vehicles[1].start" for a vehicle of the fleet.
  [[nodiscard]] std::string vehicle_key(std::size_t number, const std::string& key) const;

  /// "scenario.yaml:12" for a key, or the path where the key is not in the file.
  [[nodiscard]] std::string location(const std::string& key) const;

  /// Runs `action` for what a key names; an InputError in it also says where the key stands.
  template <class Action>
  auto at(const std::string& key, const Action& action) const {
    return at_key(location(key), key, action);
  }

  /// What its obstacles are made from; the scenario must outlive it. Nothing is kept free.
  [[nodiscard]] ObstacleWorld obstacle_world(std::shared_ptr<const SurfelMap> map) const;

  /// Opens the map, or makes the one of its world, which takes seconds.
  /// Throws InputError if it is another than `map_hash` says.
  [[nodiscard]] std::shared_ptr<const SurfelMap> open_map(const Progress& progress = {}) const;

  /// What it flies in, for messages and summaries: the map's path, or the name of its world.
  [[nodiscard]] std::string map_name() const;
};

/// The one list of keys of a scenario file: reader, `scenario new` and docs/scenario.md use it.
void describe(SettingsVisitor& visitor, Scenario& scenario);

/// Reads a scenario file. Throws InputError with file and line.
Scenario load_scenario(const std::string& path);

/// From text, for tests and fuzzers.
Scenario parse_scenario(std::string_view text, const std::string& path);

/// The scenario as a commented file.
std::string scenario_yaml(const Scenario& scenario);

/// Markdown table of all keys.
std::string scenario_reference();

}  // namespace pointflight
