#include "pointflight/sim/scenario.hpp"

#include <fmt/format.h>

#include <array>
#include <filesystem>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/resources.hpp"

namespace pointflight {
namespace {

constexpr std::array<std::string_view, 2> kRenderers = {"beam", "paper"};
constexpr std::array<std::string_view, 2> kReactions = {"report", "stop"};
constexpr std::array<std::string_view, 2> kYawModes = {"along_path", "fixed"};
constexpr double kFar = 1e7;  // m: coordinates of a UTM zone fit

Key required(Key key) {
  key.required = true;
  return key;
}

void describe_vehicle(SettingsVisitor& v, VehicleSetup& s) {
  v.value({"model", "", "name of a shipped vehicle, or a path"}, s.model);
  v.value({"start", "m", "where it hovers at first", -kFar, kFar}, s.start);
  v.value({"start_yaw_deg", "deg", "heading at first, from x towards y", -360, 360},
          s.start_yaw_deg);
  v.choice({"on_collision", "", "go on, or end the run"}, s.on_collision, kReactions);
}

void describe_lidar(SettingsVisitor& v, LidarMount& s) {
  v.value(required({"model", "", "name of a shipped sensor, or a path"}), s.model);
  v.value({"position", "m", "in the body frame", -10, 10}, s.position);
  v.value({"rotation_rpy_deg", "deg", "roll, pitch, yaw of its axes in the body", -360, 360},
          s.rotation_rpy_deg);
  v.choice({"renderer", "", "how points are made"}, s.renderer, kRenderers);
  v.value({"snapshot", "", "all beams of a scan from one pose"}, s.snapshot);
  v.value({"noise", "", "range noise of the sensor file"}, s.noise);
}

void describe_mission(SettingsVisitor& v, MissionSettings& s) {
  v.value({"speed", "m/s", "greatest speed", 0.01, 100}, s.motion.speed);
  v.value({"acceleration", "m/s^2", "greatest acceleration", 0.01, 100}, s.motion.acceleration);
  v.value({"jerk", "m/s^3", "greatest change of acceleration", 0.01, 1000}, s.motion.jerk);
  v.choice({"yaw", "", "turn to the next waypoint, or keep the heading"}, s.yaw, kYawModes);
  v.value({"yaw_rate_deg", "deg/s", "greatest rate while turning", 1, 720}, s.yaw_rate_deg);
  v.value({"hold", "s", "rest at each waypoint", 0, 3600}, s.hold);
  v.value({"waypoints", "m", "straight legs between them", -kFar, kFar}, s.waypoints);
}

void describe_output(SettingsVisitor& v, OutputSetup& s) {
  v.value({"trajectory_rate", "Hz", "rows of trajectory.csv and trajectory.tum", 0.1, 100000},
          s.trajectory_rate);
  v.value({"scans", "", "write scans as PCD"}, s.scans);
  v.value({"imu", "", "write imu.csv"}, s.imu);
}

Scenario read(SettingsReader& reader, const std::string& path) {
  Scenario scenario;
  describe(reader, scenario);
  reader.finish();
  scenario.path = path;
  scenario.lines = reader.lines();
  return scenario;
}

}  // namespace

void describe(SettingsVisitor& v, Scenario& s) {
  v.value(required({"map", "", ".pfmap to fly in"}), s.map);
  v.value({"seed", "", "of everything random", 0, 9e15}, s.seed);
  v.value({"duration", "s", "0: as long as the mission takes", 0, 1e6}, s.duration);
  v.value({"physics_step", "s", "of the integrator", 0.0001, 0.005}, s.physics_step);
  v.section({"vehicle", "", "what flies"},
            [&](SettingsVisitor& w) { describe_vehicle(w, s.vehicle); });
  v.list({"lidars", "", "what it carries"}, s.lidars, [](SettingsVisitor& w, LidarMount& mount) {
    describe_lidar(w, mount);
  });
  v.section({"mission", "", "where it flies; without waypoints it hovers"},
            [&](SettingsVisitor& w) { describe_mission(w, s.mission); });
  v.section({"output", "", "what is written"},
            [&](SettingsVisitor& w) { describe_output(w, s.output); });
}

std::string Scenario::folder() const {
  return std::filesystem::path(path).parent_path().string();
}

std::string Scenario::place(const std::string& key) const {
  const auto line = lines.find(key);
  return line == lines.end() ? path : fmt::format("{}:{}", path, line->second);
}

std::shared_ptr<const SurfelMap> Scenario::open_map() const {
  return at("map", [&] { return SurfelMap::open(resolve_path(map, folder())); });
}

Scenario load_scenario(const std::string& path) {
  SettingsReader reader(path);
  return read(reader, path);
}

Scenario parse_scenario(std::string_view text, const std::string& path) {
  SettingsReader reader(text, path);
  return read(reader, path);
}

std::string scenario_yaml(const Scenario& scenario) {
  Scenario copy = scenario;
  SettingsWriter writer;
  describe(writer, copy);
  return writer.text();
}

std::string scenario_reference() {
  Scenario defaults;
  SettingsTable table;
  describe(table, defaults);
  return table.text();
}

}  // namespace pointflight
