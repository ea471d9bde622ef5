#include "pointflight/share/common_ground.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "pointflight/core/hash.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/core/version.hpp"
#include "pointflight/share/share_setup.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

std::string hash_of(std::string_view text) {
  return fmt::format("{:016x}", hash64(std::as_bytes(std::span(text.data(), text.size()))));
}

/// Hash of a file that the scenario names; empty for none.
std::string content_of(const std::string& path, const Scenario& scenario) {
  if (path.empty()) return {};
  return hash_of(MappedFile(resolve_path(path, scenario.folder())).text());
}

/// A copy of a sensor may lie in another format.
void keep_stem(std::string& path) {
  path = fs::path(path).stem().string();
}

template <class Settings>
std::string text_of(Settings settings) {
  settings.path.clear();
  SettingsWriter writer;
  describe(writer, settings);
  return writer.text();
}

/// The scenario without what may differ from host to host and what has a part of its own.
std::string rest_of(Scenario scenario) {
  scenario.path.clear();
  scenario.map.clear();
  scenario.world.reset();
  scenario.map_hash.clear();
  scenario.seed = 0;
  scenario.duration = 0.0;
  scenario.output = {};
  scenario.sections.erase("ros");
  ShareSetup share = share_setup_of(scenario);
  share.on_return = OnReturn::kStart;  // each process for itself
  scenario.sections["share"] = share;
  for (VehicleSetup& vehicle : scenario.vehicles) {
    keep_stem(vehicle.model);
    for (LidarMount& mount : vehicle.lidars) {
      keep_stem(mount.model);
      keep_stem(mount.blocked);
    }
    for (CommandSettings& command : vehicle.commands) keep_stem(command.file);
  }
  for (ObstacleSettings& obstacles : scenario.obstacles) {
    keep_stem(obstacles.file);
    keep_stem(obstacles.keyframes);
  }
  return scenario_yaml(scenario);
}

std::string vehicles_of(const Simulation& simulation) {
  std::string text;
  for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
    const VehicleAgent& agent = simulation.vehicle(v);
    text += agent.setup().name + "\n" + text_of(agent.settings());
    for (const CommandSettings& command : agent.setup().commands) {
      text += content_of(command.file, simulation.scenario());
    }
    for (const MountedLidar* mounted : agent.lidars()) text += text_of(mounted->lidar().settings());
  }
  return text;
}

/// Their files, and where they begin: functions of seed, map and files.
std::string obstacles_of(const Simulation& simulation) {
  const Scenario& scenario = simulation.scenario();
  std::string text;
  for (const ObstacleSettings& obstacles : scenario.obstacles) {
    text += content_of(obstacles.file, scenario) + content_of(obstacles.keyframes, scenario) + "\n";
  }
  for (const Body& body : simulation.obstacles(SimTime{}, SimTime{})) {
    const Vector3d p = body.T_world_body(std::max(SimTime{}, body.from)).translation;
    text += fmt::format(
        "{} {} {} {} {}\n", body.label, p.x(), p.y(), p.z(), bounding_radius(body.shape));
  }
  return text;
}

}  // namespace

std::vector<share_msg::Part> common_ground(const Simulation& simulation, double rate) {
  const Scenario& scenario = simulation.scenario();
  return {{"version of pointflight", kVersion},
          {"map", simulation.map().hash()},
          {"seed", std::to_string(scenario.seed)},
          {"rate", fmt::format("{}", rate)},
          {"set of vehicles or sensors", hash_of(vehicles_of(simulation))},
          {"set of obstacles", hash_of(obstacles_of(simulation))},
          {"scenario", hash_of(rest_of(scenario))}};
}

bool was_run_of(const Scenario& earlier, const Simulation& simulation) {
  const Scenario& scenario = simulation.scenario();
  return earlier.map_hash == simulation.map().hash() && earlier.seed == scenario.seed &&
         rest_of(earlier) == rest_of(scenario);
}

bool describes_alike(const std::vector<share_msg::Part>& theirs,
                     const std::vector<share_msg::Part>& ours) {
  return std::equal(
      theirs.begin(), theirs.end(), ours.begin(), ours.end(), [](const auto& a, const auto& b) {
        return a.name == b.name;
      });
}

std::optional<std::string> difference(const std::vector<share_msg::Part>& theirs,
                                      const std::vector<share_msg::Part>& ours) {
  const auto [their, our] = std::mismatch(theirs.begin(), theirs.end(), ours.begin(), ours.end());
  if (our == ours.end()) return std::nullopt;
  constexpr std::size_t kMost = 40;
  return fmt::format(
      "another {} ({} there, {} here)", our->name, their->value.substr(0, kMost), our->value);
}

}  // namespace pointflight
