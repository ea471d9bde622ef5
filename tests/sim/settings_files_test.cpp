#include <fmt/format.h>
#include <gtest/gtest.h>

#include <set>
#include <sstream>

#include "pointflight/core/resources.hpp"
#include "pointflight/lidar/beam_pattern.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/sim/scenario.hpp"
#include "pointflight/vehicle/airframe.hpp"
#include "tests/paths.hpp"
#include "tests/support.hpp"

/// What sensor, vehicle and scenario files have in common: no key without effect, pages that show
/// every key.
namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::read_file;

std::string lidar_error(const std::string& text) {
  return error_of([&] { make_pattern(parse_lidar("range_max: 10\n" + text, "x.yaml")); });
}

TEST(KeysWithoutEffect, OfASensorAreErrorsWithLineAndVariant) {
  struct Case {
    const char* text;
    const char* words;
  };
  for (const Case& c : std::vector<Case>{
           {"pattern: rings\nrings:\n  table: velodyne_vlp32c\n  columns: 900\n",
            "x.yaml:5: rings.columns: has no effect here: it is for `convention: ouster`"},
           {"pattern: rings\nrings: {channels: 4, convention: ouster, cycle_us: 50}\n",
            "rings.cycle_us: has no effect here: it is for `convention: velodyne or hesai`"},
           {"pattern: grid\nrings: {table: velodyne_vlp32c}\n",
            "x.yaml:3: rings: has no effect here: it is for `pattern: rings`"},
           {"pattern: grid\ngrid: {fx: 300}\n", "for `projection: pinhole`"},
           {"pattern: grid\ngrid: {projection: pinhole, fx: 3, fy: 3, fov_vertical_deg: 30}\n",
            "for `projection: angular`"},
           {"pattern: rings\nrings: {table: velodyne_vlp32c, elevations_deg: [1, 2]}\n",
            "rings.elevations_deg: has no effect beside rings.table"},
           {"pattern: rings\nrings: {table: velodyne_vlp32c, channels: 3}\n",
            "rings.channels: has no effect beside rings.table"},
           {"pattern: rings\nrings: {elevations_deg: [1], channels: 3}\n",
            "rings.channels: has no effect beside rings.elevations_deg"},
           {"pattern: rings\nrings: {channels: 3, azimuth_offsets_deg: [1, 2, 3]}\n",
            "for `elevations_deg`"},
           {"pattern: rings\nrings: {elevations_deg: [1], elevation_min_deg: -3}\n",
            "for `channels`"},
           {"pattern: rings\nrings: {table: velodyne_vlp32c, channel_interval_us: 2}\n",
            "rings.channel_interval_us: has no effect here: velodyne_vlp32c has a fire_time_us"}}) {
    SCOPED_TRACE(c.text);
    expect_contains(lidar_error(c.text), c.words);
  }
}

TEST(KeysWithoutEffect, OfAVehicleAreErrors) {
  const std::string plain = read_file(data_folder() + "/vehicles/quad_330.yaml");
  const auto error = [&](const std::string& before, const std::string& after) {
    std::string text = plain;
    const std::size_t at = text.find(before);
    EXPECT_NE(at, std::string::npos) << before;
    text.replace(at, before.size(), after);
    return error_of([&] { parse_vehicle(text, "v.yaml"); });
  };
  expect_contains(error("radius: 0.26", "size: [1, 1, 1]"), "size: has no effect here");
  expect_contains(error("radius: 0.26", "height: 1"), "`shape: cylinder, capsule`");
  expect_contains(error("radius: 0.26", "shape: box\nradius: 0.26"), "radius: has no effect here");
  expect_contains(error("natural_frequency: 100", "natural_frequency: 0"),
                  "rotor.damping: has no effect here");
  expect_contains(error("cells: 4", "cells: 0"), "battery.capacity: has no effect here");
  expect_contains(
      error("  yaw: {natural_frequency: 5, ", "  kind: geometric\n  yaw: {integral: 0.1, "),
      "controller.yaw.integral: has no effect here: it is for `controller.kind: cascade`");
}

TEST(KeysWithoutEffect, OfAScenarioAreErrors) {
  const auto error = [](const std::string& text) {
    return error_of([&] { parse_scenario("map: m.pfmap\n" + text, "s.yaml"); });
  };
  for (const auto& [command, key] : std::vector<std::pair<std::string, std::string>>{
           {"kind: land, height: 3", "height"},
           {"kind: hover, speed: 3", "speed"},
           {"kind: velocity, feed_forward: [1, 0, 0]", "feed_forward"},
           {"kind: waypoint, yaw_deg: 3", "yaw_deg"},
           {"kind: position, thrust: 3", "thrust"},
           {"kind: attitude, vector: [1, 2, 3]", "vector"},
           {"kind: polynomial, file: a.csv, degree: 3", "degree"},
           {"kind: take_off, rpy_deg: [1, 2, 3]", "rpy_deg"},
           {"kind: velocity, rotors: [1, 2, 3, 4]", "rotors"}}) {
    expect_contains(error(fmt::format("commands:\n  - {{{}}}\n", command)),
                    fmt::format("s.yaml:3: commands[0].{}: has no effect here", key));
  }
  for (const auto& [fault, key] :
       std::vector<std::pair<std::string, std::string>>{{"kind: imu, index: 1", "index"},
                                                        {"kind: imu, value: 0.5", "value"},
                                                        {"kind: rotor, axis: gyro_x", "axis"},
                                                        {"kind: lidar, value: 0.5", "value"}}) {
    expect_contains(error(fmt::format("faults:\n  - {{{}}}\n", fault)),
                    fmt::format("faults[0].{}: has no effect here", key));
  }
  for (const auto& [obstacle, key] : std::vector<std::pair<std::string, std::string>>{
           {"shape: box, radius: 1", "radius"},
           {"shape: sphere, height: 1", "height"},
           {"shape: sphere, size: [1, 1, 1]", "size"},
           {"shape: sphere, file: a.pcd", "file"},
           {"shape: cloud, file: a.pfmap, resolution: 0.1", "resolution"},
           {"shape: cloud, file: a.pcd, intensity: 3", "intensity"},
           {"motion: still, speed: 1", "speed"},
           {"motion: still, count: 2", "count"},
           {"motion: still, radius_max: 2", "radius_max"},
           {"motion: loop, waypoints: [[1, 1, 1]], speed_max: 3", "speed_max"},
           {"motion: loop, waypoints: [[1, 1, 1]], repeat: true", "repeat"},
           {"motion: random, position: [1, 1, 1]", "position"},
           {"motion: keyframes, keyframes: a.csv, at_border: bounce", "at_border"}}) {
    expect_contains(error(fmt::format("obstacles:\n  - {{{}}}\n", obstacle)),
                    fmt::format("obstacles[0].{}: has no effect here", key));
  }
  expect_contains(error("lidars:\n  - {model: avia, renderer: paper, snapshot: true}\n"),
                  "lidars[0].snapshot: has no effect here: it is for `renderer: beam`");
  expect_contains(error("air: {wind: {turbulence: light, gust_sigma: [1, 1, 1]}}\n"),
                  "air.wind.gust_sigma: has no effect here: it is for `turbulence: custom`");
  expect_contains(error("ros:\n  outputs:\n    - {kind: imu, topic: /a, layout: xyzi}\n"),
                  "ros.outputs[0].layout: has no effect here");
  expect_contains(error("ros:\n  inputs:\n    - {kind: goal, topic: /a, unit: rpm}\n"),
                  "ros.inputs[0].unit: has no effect here");
}

TEST(KeysWithoutEffect, AreNotWritten) {
  // what is written reads back, whatever the variant
  Scenario scenario;
  scenario.map = "m.pfmap";
  scenario.vehicles[0].lidars[0].renderer = "paper";
  for (const ScriptedCommand& kind : ScriptedCommand::table().rows()) {
    scenario.vehicles[0].commands.emplace_back().kind = kind.name;
  }
  for (int kind = 0; kind <= static_cast<int>(FaultKind::kScanDrop); ++kind) {
    scenario.vehicles[0].faults.emplace_back().kind = static_cast<FaultKind>(kind);
  }
  for (int motion = 0; motion <= static_cast<int>(ObstacleMotion::kKeyframes); ++motion) {
    const auto add = [&](const std::optional<Choice<SolidKind>>& shape) {
      auto& obstacle = scenario.obstacles.emplace_back();
      obstacle.motion = static_cast<ObstacleMotion>(motion);
      obstacle.shape = shape;
    };
    for (const SolidKind& kind : SolidKind::table().rows()) add(Choice<SolidKind>(kind.name));
    add(std::nullopt);
  }
  const std::string text = scenario_yaml(scenario);
  EXPECT_EQ(scenario_yaml(parse_scenario(text, "s.yaml")), text);
}

/// The blocks of a kind of a page.
std::vector<std::string> blocks_of(const std::string& page, const std::string& kind) {
  std::vector<std::string> blocks;
  std::istringstream lines(page);
  bool inside = false;
  for (std::string line; std::getline(lines, line);) {
    if (line == "```" + kind) {
      inside = true;
      blocks.emplace_back();
    } else if (line == "```") {
      inside = false;
    } else if (inside) {
      blocks.back() += line + "\n";
    }
  }
  return blocks;
}

/// "rings.table", ... of a table of keys.
std::set<std::string> keys_of(const std::string& reference) {
  std::set<std::string> keys;
  std::istringstream lines(reference);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("| `", 0) == 0) keys.insert(line.substr(3, line.find('`', 3) - 3));
  }
  return keys;
}

/// Without the numbers of lists: "prisms.wedges[0].rate" is "prisms.wedges[].rate".
std::string without_numbers(const std::string& key) {
  std::string plain;
  for (std::size_t i = 0; i < key.size(); ++i) {
    plain += key[i];
    if (key[i] == '[') i = key.find(']', i) - 1;
  }
  return plain;
}

TEST(Pages, ExamplesOfSensorFilesLoadAndHoldEveryKey) {
  const auto blocks =
      blocks_of(read_file(std::string(testing::kSource) + "/docs/sensors.md"), "yaml");
  ASSERT_GE(blocks.size(), 8u);
  std::set<std::string> missing = keys_of(lidar_reference());
  ASSERT_GT(missing.size(), 40u);
  for (const std::string& block : blocks) {
    const LidarSettings settings = parse_lidar(block, "docs/sensors.md");
    if (settings.pattern != ScanPattern::kCsv) {  // whose file is the user's
      EXPECT_FALSE(make_pattern(settings)->beams(0, Executor(1)).empty()) << block;
    }
    for (const auto& [key, line] : settings.lines) missing.erase(without_numbers(key));
  }
  missing.erase("prisms.wedges[].flat_first");  // true or false: no line is kept
  EXPECT_TRUE(missing.empty()) << "not shown: " << *missing.begin();
}

TEST(Pages, TheExampleOfAScenarioLoads) {
  const auto blocks =
      blocks_of(read_file(std::string(testing::kSource) + "/docs/scenario.md"), "yaml");
  ASSERT_EQ(blocks.size(), 1u);
  const Scenario scenario = parse_scenario(blocks[0], "docs/scenario.md");
  const VehicleSetup& vehicle = scenario.vehicles[0];
  EXPECT_EQ(vehicle.controller_input, ControllerInput::kOdometry);
  EXPECT_FALSE(vehicle.odometry.is_true());
  EXPECT_EQ(vehicle.sensors.size(), 4u);
}

TEST(Pages, TheExampleOfAVehicleFileLoadsAndHoldsEveryKey) {
  const auto blocks =
      blocks_of(read_file(std::string(testing::kSource) + "/docs/vehicles.md"), "yaml");
  ASSERT_EQ(blocks.size(), 1u);
  const VehicleSettings settings = parse_vehicle(blocks[0], "docs/vehicles.md");
  EXPECT_GT(settings.thrust_to_weight(), 2.0);
  for (const std::string& key : keys_of(vehicle_reference())) {
    if (key == "radius" || key == "height") continue;  // of the other shapes
    const std::string name = key.substr(key.rfind('.') + 1);
    EXPECT_NE(blocks[0].find(name + ":"), std::string::npos) << key;
  }
}

}  // namespace
}  // namespace pointflight
