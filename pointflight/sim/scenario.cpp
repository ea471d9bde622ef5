#include "pointflight/sim/scenario.hpp"

#include <fmt/format.h>

#include <array>
#include <filesystem>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/resources.hpp"

namespace pointflight {
namespace {

constexpr Named<Unfinished> kUnfinished[] = {{Unfinished::kFailure, "failure"},
                                             {Unfinished::kTimeUp, "time_up"}};
constexpr Named<CollisionReaction> kReactions[] = {{CollisionReaction::kReport, "report"},
                                                   {CollisionReaction::kStop, "stop"},
                                                   {CollisionReaction::kCrash, "crash"}};
constexpr Named<ControllerInput> kControllerInputs[] = {{ControllerInput::kTruth, "truth"},
                                                        {ControllerInput::kOdometry, "odometry"}};
constexpr Named<LowBatteryReaction> kLowBattery[] = {{LowBatteryReaction::kLand, "land"},
                                                     {LowBatteryReaction::kFall, "fall"},
                                                     {LowBatteryReaction::kReport, "report"}};
constexpr Named<AutopilotKind> kAutopilots[] = {{AutopilotKind::kOwn, "own"},
                                                {AutopilotKind::kPx4, "px4"},
                                                {AutopilotKind::kArduPilot, "ardupilot"}};
constexpr Named<YawMode> kYawModes[] = {{YawMode::kAlongPath, "along_path"},
                                        {YawMode::kFixed, "fixed"}};
/// Sections of pointflight's higher floors: no mistake in a program that is built on the core
/// alone.
constexpr const char* kHigherSections[] = {"ros", "share"};

Key required(Key key) {
  key.required = true;
  return key;
}

void describe_lidar(SettingsVisitor& v, LidarMount& s) {
  v.value(required({"model", "", "name of a shipped sensor, or a path"}), s.model);
  v.value({"position", "m", "in the body frame", -10, 10}, s.position);
  v.value({"rotation_rpy_deg", "deg", "roll, pitch, yaw of its axes in the body", -360, 360},
          s.rotation_rpy_deg);
  v.choice({"renderer", "", "how points are made"}, s.renderer);
  v.only_if(!s.renderer->one_pose, "renderer: beam", [&](SettingsVisitor& w) {
    w.value({"snapshot", "", "all beams of a scan from one pose, as the paper's always"},
            s.snapshot);
  });
  v.value({"noise", "", "of ranges and directions, by the sensor file"}, s.noise);
  v.value(
      {"sub_rays",
       "",
       "rays over each beam's cross-section; 0: as many as it takes, 1: beams are lines, -1: as "
       "the sensor file says",
       -1,
       4096},
      s.sub_rays);
  v.value({"blocked",
           "",
           "CSV of directions in which the vehicle is in its way (docs/sensors.md); empty: as the "
           "sensor file says"},
          s.blocked);
  v.value({"mark_unknown",
           "",
           "points say whether their beams crossed space that no survey saw (a map made or fitted "
           "with `--scans`)"},
          s.mark_unknown);
  v.value({"own_airframe",
           "",
           "it sees the vehicle that carries it: arms and propellers, and what they hide"},
          s.own_airframe);
  v.value({"truth",
           "",
           "its files also say what the simulator knows of each point: true range, incidence, "
           "surfel, sub-ray, deskewed position"},
          s.truth);
}

void describe_mission(SettingsVisitor& v, MissionSettings& s) {
  v.value({"speed", "m/s", "greatest speed", 0.01, 100}, s.motion.speed);
  v.value({"acceleration", "m/s^2", "greatest acceleration", 0.01, 100}, s.motion.acceleration);
  v.value({"jerk", "m/s^3", "greatest change of acceleration", 0.01, 1000}, s.motion.jerk);
  v.choice({"yaw", "", "turn to the next waypoint, or keep the heading"}, s.yaw, kYawModes);
  v.value({"yaw_rate_deg", "deg/s", "greatest rate while turning", 1, 720}, s.yaw_rate_deg);
  v.value({"hold", "s", "rest at each waypoint", 0, 3600}, s.hold);
  v.value({"waypoints", "m", "straight legs between them", -kFarthest, kFarthest}, s.waypoints);
}

void describe_limits(SettingsVisitor& v, LimitSetup& s) {
  v.value({"speed_max", "m/s", "of velocity and position commands", 0, 200}, s.speed_max);
  v.value({"acceleration_max", "m/s^2", "horizontal", 0, 100}, s.acceleration_max);
  v.value({"climb_acceleration_max", "m/s^2", "up", 0, 100}, s.climb_acceleration_max);
  v.value({"tilt_max_deg", "deg", "greatest tilt", 0, 180}, s.tilt_max_deg);
  v.value({"body_rate_max", "rad/s", "greatest demanded rates", 0, 100}, s.body_rate_max);
}

void describe_autopilot(SettingsVisitor& v, AutopilotSetup& s) {
  v.choice({"kind", "", "our own, or a firmware beside the program"}, s.kind, kAutopilots);
  const bool is_firmware = s.kind != AutopilotKind::kOwn;
  v.only_if(is_firmware, "a firmware's kind", [&](SettingsVisitor& w) {
    w.value(
        {"instance", "", "of the firmware, whose ports follow; -1: the vehicle's number", -1, 200},
        s.instance);
    w.value({"wait", "s", "for an answer; then the run goes on without", 0.1, 3600}, s.wait);
  });
  v.only_if(s.kind == AutopilotKind::kPx4, "kind: px4", [&](SettingsVisitor& w) {
    w.value({"vision", "", "it gets odometry as external vision"}, s.vision);
    w.value({"obstacles", "", "it gets what the first LiDAR sees around it, as OBSTACLE_DISTANCE"},
            s.obstacles);
  });
}

void describe_airframe(SettingsVisitor& v, VehicleSetup& s) {
  v.value({"name", "", "of its files and topics; empty: drone0, drone1, ..."}, s.name);
  v.value({"model", "", "name of a shipped vehicle, or a path"}, s.model);
  v.value({"start", "m", "where it hovers at first", -kFarthest, kFarthest}, s.start);
  v.value({"start_yaw_deg", "deg", "heading at first, from x towards y", -360, 360},
          s.start_yaw_deg);
  v.value({"landed", "", "start with rotors off, carried by the ground"}, s.landed);
  v.value({"copies", "", "so many alike, each with its own number", 1, 1000}, s.copies);
  v.value({"copy_offset", "m", "of start and waypoints, from copy to copy", -kFarthest, kFarthest},
          s.copy_offset);
  v.value({"seed", "", "of its sensors and gusts; -1: the run's", -1, 9e15}, s.seed);
  v.choice({"on_collision", "", "go on, end the run, or fall with rotors off"},
           s.on_collision,
           kReactions);
  v.choice({"controller", "", "vehicle: the one of its file"}, s.controller, "vehicle");
  v.section({"autopilot", "", "who flies it"}, {.one = "kind"}, [&](SettingsVisitor& w) {
    describe_autopilot(w, s.autopilot);
  });
  v.value({"imu_rate", "Hz", "of its IMU; 0: the vehicle file's", 0, 8000}, s.imu_rate);
  v.value(
      {"control_period",
       "s",
       "of its controllers, whole physics steps, over which rotor commands are held; 0: each step",
       0,
       0.1},
      s.control_period);
  v.value({"command_timeout", "s", "hover without a command for so long; 0: never", 0, 3600},
          s.command_timeout);
  v.value({"battery", "", "fly on the vehicle's battery"}, s.battery);
  v.choice({"on_low_battery",
            "",
            "at the battery's reserve: land and take no more commands, stop the rotors, or go on "
            "until it is empty, when the rotors stop in any case"},
           s.on_low_battery,
           kLowBattery);
  v.section({"odometry", "", "how it errs; all 0: it reports the truth"},
            [&](SettingsVisitor& w) { describe(w, s.odometry); });
  v.choice(
      {"controller_input",
       "",
       "what its controllers take for its state: the truth, or the truth as far off as the last "
       "odometry was"},
      s.controller_input,
      kControllerInputs);
  v.section({"limits", "", "instead of the vehicle file's; 0: its own"},
            [&](SettingsVisitor& w) { describe_limits(w, s.limits); });
}

void describe_equipment(SettingsVisitor& v, VehicleSetup& s) {
  v.list({"lidars", "", "what it carries"}, s.lidars, [](SettingsVisitor& w, LidarMount& mount) {
    describe_lidar(w, mount);
  });
  v.list({"sensors", "", "what else it measures with"},
         s.sensors,
         [](SettingsVisitor& w, SensorSetup& sensor) { describe(w, sensor); });
  v.section({"mission", "", "where it flies; without waypoints it hovers"},
            [&](SettingsVisitor& w) { describe_mission(w, s.mission); });
  v.list({"commands", "", "what it is told, in the order of time"},
         s.commands,
         [](SettingsVisitor& w, CommandSettings& command) { describe(w, command); });
  v.list({"faults", "", "what goes wrong"}, s.faults, [](SettingsVisitor& w, FaultSettings& fault) {
    describe(w, fault);
  });
}

void describe_output(SettingsVisitor& v, OutputSetup& s) {
  v.value({"trajectory_rate", "Hz", "rows of trajectory.csv and trajectory.tum", 0.1, 100000},
          s.trajectory_rate);
  v.value({"scans", "", "write scans as PCD"}, s.scans);
  v.value({"imu", "", "write imu.csv"}, s.imu);
  v.value({"odometry", "", "write odometry.csv"}, s.odometry);
  v.value({"odometry_rate", "Hz", "of odometry", 0.1, 10000}, s.odometry_rate);
  v.value({"obstacle_rate", "Hz", "rows of obstacles.csv for each obstacle", 0.1, 1000},
          s.obstacle_rate);
}

struct WorldValueKeys {
  std::string key;  ///< Name of the parameter.
  double value = 0.0;
};

void describe_world(SettingsVisitor& v, WorldMapOptions& s) {
  const std::vector<std::string_view> names = WorldKind::table().names();
  v.choice(required({"world", "", "name of a kind"}), s.world.name, names);
  auto seed = static_cast<std::int64_t>(s.world.seed);
  v.value({"seed", "", "which world of this kind; not the run's seed", 0, 9e15}, seed);
  s.world.seed = static_cast<std::uint64_t>(seed);
  v.value({"resolution", "m", "of its map", 0.02, 1.0}, s.resolution);
  v.section({"set", "", "parameters that the seed does not draw (`pointflight world show NAME`)"},
            [&](SettingsVisitor& w) {
              std::vector<WorldValueKeys> values;
              for (const auto& [name, value] : s.world.chosen) values.push_back({name, value});
              w.others({"", "", ""}, {.one = "value"}, values, [](auto& u, WorldValueKeys& one) {
                u.value(required({"value", "", "of the parameter"}), one.value);
              });
              s.world.chosen.clear();
              for (const WorldValueKeys& one : values) s.world.chosen[one.key] = one.value;
            });
}

Scenario read(SettingsReader& reader, const std::string& path) {
  Scenario scenario;
  if (reader.is_section("map")) scenario.world.emplace();
  for (const char* key : {"vehicle", "lidars", "sensors", "mission", "commands", "faults"}) {
    scenario.is_short = scenario.is_short || reader.has(key);
  }
  describe(reader, scenario);
  reader.finish();
  scenario.path = path;
  scenario.lines = reader.lines();
  if (scenario.world) scenario.at("map", [&] { return values_of(scenario.world->world); });
  return scenario;
}

}  // namespace

Registry<ScenarioSection>& scenario_sections() {
  static Registry<ScenarioSection> sections;
  return sections;
}

void describe(SettingsVisitor& v, Scenario& s) {
  if (s.world) {
    v.section({"map", "", "a made-up world to fly in"},
              [&](SettingsVisitor& w) { describe_world(w, *s.world); });
  } else {
    v.value(required({"map", "", ".pfmap to fly in; or keys of a made-up world, `map.`"}), s.map);
  }
  v.value({"map_hash", "", "of the map; another one is refused; empty: any will do"}, s.map_hash);
  v.value({"seed", "", "of everything random", 0, 9e15}, s.seed);
  v.value({"duration", "s", "0: as long as the mission takes", 0, kLongestRun}, s.duration);
  v.choice(
      {"unfinished",
       "",
       "what an end by duration is with a mission unfinished: a failure (exit code 1), or time is "
       "up (0; what --duration asks for)"},
      s.unfinished,
      kUnfinished);
  v.value({"physics_step", "s", "of the integrator", 0.0001, 0.005}, s.physics_step);
  if (s.is_short) {
    VehicleSetup& vehicle = s.vehicles.front();
    v.section({"vehicle", "", "what flies"},
              [&](SettingsVisitor& w) { describe_airframe(w, vehicle); });
    describe_equipment(v, vehicle);
  } else {
    v.list(
        {"vehicles", "", "what flies"}, s.vehicles, [](SettingsVisitor& w, VehicleSetup& vehicle) {
          describe_airframe(w, vehicle);
          describe_equipment(w, vehicle);
        });
  }
  v.list({"obstacles", "", "what moves by itself"},
         s.obstacles,
         [](SettingsVisitor& w, ObstacleSettings& obstacle) { describe(w, obstacle); });
  v.section({"air", "", "wind and ground effect"}, [&](SettingsVisitor& w) {
    w.section({"wind", "", "over the whole map"},
              [&](SettingsVisitor& x) { describe(x, s.air.wind); });
    w.value({"ground_effect", "", "more thrust near the ground, for vehicles with rotor.radius"},
            s.air.ground_effect);
  });
  v.section({"surroundings", "", "what the returns of LiDARs depend on"},
            [&](SettingsVisitor& w) { describe(w, s.surroundings); });
  v.section({"origin", "", "of the world on the earth: x east, y north"},
            [&](SettingsVisitor& w) { describe(w, s.origin); });
  v.section({"output", "", "what is written"},
            [&](SettingsVisitor& w) { describe_output(w, s.output); });
  for (const ScenarioSection& row : scenario_sections().rows()) {
    std::any& settings = s.sections.try_emplace(row.name, row.settings).first->second;
    v.section({row.name, "", row.help}, [&](SettingsVisitor& w) { row.describe(w, settings); });
  }
  for (const char* name : kHigherSections) {
    if (scenario_sections().find(name) == nullptr) v.leave_as_is(name, s.sections_as_is[name]);
  }
}

std::vector<VehicleSetup> Scenario::fleet() const {
  std::vector<VehicleSetup> fleet;
  for (const VehicleSetup& setup : vehicles) {
    for (std::int64_t copy = 0; copy < setup.copies; ++copy) {
      VehicleSetup& one = fleet.emplace_back(setup);
      const Vector3d offset = static_cast<double>(copy) * setup.copy_offset;
      one.copies = 1;
      one.start += offset;
      for (Vector3d& waypoint : one.mission.waypoints) waypoint += offset;
      for (CommandSettings& command : one.commands) {
        if (moves_with_copies(command)) command.vector += offset;
      }
      if (one.name.empty()) {
        one.name = fmt::format("drone{}", fleet.size() - 1);
      } else if (setup.copies > 1) {
        one.name += fmt::format("{}", copy);
      }
    }
  }
  return fleet;
}

std::string Scenario::vehicle_key(std::size_t number, const std::string& key) const {
  if (is_short) {
    for (const char* section : {"lidars", "sensors", "mission", "commands", "faults"}) {
      if (key.starts_with(section)) return key;
    }
    return "vehicle." + key;
  }
  std::size_t entry = 0;
  for (; entry + 1 < vehicles.size(); ++entry) {
    const auto copies = static_cast<std::size_t>(vehicles[entry].copies);
    if (number < copies) break;
    number -= copies;
  }
  return fmt::format("vehicles[{}].{}", entry, key);
}

std::string Scenario::folder() const {
  return std::filesystem::path(path).parent_path().string();
}

std::string Scenario::location(const std::string& key) const {
  const auto line = lines.find(key);
  if (path.empty()) return "the scenario";  // made up by a program
  return line == lines.end() ? path : fmt::format("{}:{}", path, line->second);
}

ObstacleWorld Scenario::obstacle_world(std::shared_ptr<const SurfelMap> map) const {
  ObstacleWorld world;
  world.map = std::move(map);
  world.seed = static_cast<std::uint64_t>(seed);
  world.folder = folder();
  world.location = [this](std::size_t entry, const char* key) {
    const std::string name = fmt::format("obstacles[{}].{}", entry, key);
    const std::string item = fmt::format("obstacles[{}]", entry);
    return location(lines.contains(name) ? name : item) + ": " + name;
  };
  return world;
}

std::string Scenario::map_name() const {
  return world ? name_of(*world) : map;
}

std::shared_ptr<const SurfelMap> Scenario::open_map(const Progress& progress) const {
  auto opened = at("map", [&] {
    return world ? open_world_map(*world, Executor(), progress)
                 : SurfelMap::open(resolve_path(map, folder()));
  });
  if (map_hash.empty() || map_hash == opened->hash()) return opened;
  throw InputError(fmt::format(
      "{}: map_hash: {} is another map than this scenario was flown in (its hash is {}, "
      "not {}); give that one, or take the key away",
      location("map_hash"),
      map_name(),
      opened->hash(),
      map_hash));
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
  Scenario defaults;  // with one of each, so that all keys are listed
  defaults.vehicles.front().commands.resize(1);
  defaults.vehicles.front().faults.resize(1);
  defaults.obstacles.resize(1);
  for (const ScenarioSection& row : scenario_sections().rows()) {
    defaults.sections[row.name] = row.example;
  }
  SettingsTable table;
  describe(table, defaults);
  WorldMapOptions world;  // instead of a path
  table.section({"map", "", ""}, [&](SettingsVisitor& w) { describe_world(w, world); });
  return table.text();
}

}  // namespace pointflight
