#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/settings.hpp"
#include "pointflight/core/time.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/sim/mission.hpp"

namespace pointflight {

struct LidarMount {
  std::string model = "mid360";                  ///< Name or path of a sensor file.
  Vector3d position = Vector3d(0.0, 0.0, 0.1);   ///< m, body frame.
  Vector3d rotation_rpy_deg = Vector3d::Zero();  ///< Of the sensor's axes in the body.
  std::string renderer = "beam";
  bool snapshot = false;  ///< One pose a scan, as in the paper.
  bool noise = true;
};

struct VehicleSetup {
  std::string model = "quad_330";
  Vector3d start = Vector3d::Zero();
  double start_yaw_deg = 0.0;
  std::string on_collision = "report";  ///< or "stop"
};

struct OutputSetup {
  double trajectory_rate = 200.0;  ///< Hz
  bool scans = true;
  bool imu = true;
};

/// A run: what a scenario file says.
struct Scenario {
  std::string path;  ///< Of the file; relative paths in it are taken from its folder.
  std::map<std::string, int> lines;  ///< Line of each key, for messages.
  std::string map;
  std::int64_t seed = 1;
  double duration = 0.0;        ///< s; 0: as long as the mission takes.
  double physics_step = 0.001;  ///< s
  VehicleSetup vehicle;
  std::vector<LidarMount> lidars = {LidarMount{}};
  MissionSettings mission;
  OutputSetup output;

  [[nodiscard]] std::string folder() const;

  /// "scenario.yaml:12" for a key, or the path where the key is not in the file.
  [[nodiscard]] std::string place(const std::string& key) const;

  /// Runs `action` for what a key names; an InputError in it also says where the key stands.
  template <class Action>
  auto at(const std::string& key, const Action& action) const {
    return at_key(place(key), key, action);
  }

  /// Opens the map.
  [[nodiscard]] std::shared_ptr<const SurfelMap> open_map() const;
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
