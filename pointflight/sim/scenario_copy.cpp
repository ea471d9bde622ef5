#include "pointflight/sim/scenario_copy.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/lidar/lidar_settings.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

/// Copies of a scenario's files, each once, in inputs/.
class Inputs {
 public:
  Inputs(std::string scenario_folder, OutputFolder& folder)
      : from_(std::move(scenario_folder)), folder_(folder) {}

  /// Copies a file that a setting names, and lets the setting name the copy.
  void take(std::string& setting) {
    if (setting.empty()) return;
    const std::string path = resolve_path(setting, from_);
    const auto [name, is_new] = name_for(path);
    if (is_new) copy(path, name);
    setting = "inputs/" + name;
  }

  /// A model by name stays a name.
  void take_model(std::string& setting) {
    if (is_model_path(setting)) take(setting);
  }

  /// A sensor's file names tables beside it; one of a vendor's becomes a sensor file.
  void take_lidar(std::string& setting) {
    if (!is_model_path(setting)) return;
    const std::string path = resolve_path(setting, from_);
    const auto [name, is_new] = name_for(path, ".yaml");
    setting = "inputs/" + name;
    if (!is_new) return;
    LidarSettings sensor = load_lidar(path);
    for (std::string* table : tables_of(sensor)) {
      const auto [table_name, table_is_new] = name_for(*table);
      if (table_is_new) copy(*table, table_name);
      *table = "./" + table_name;
    }
    SettingsWriter writer;
    describe(writer, sensor);
    write(name, writer.text());
  }

 private:
  /// A name in inputs/, and whether the file is not there yet. What is kept under another extension
  /// is another file: a table of directions may be a sensor and one's table.
  std::pair<std::string, bool> name_for(const std::string& path,
                                        const std::string& extension = {}) {
    const std::string source = fs::weakly_canonical(path).string() + extension;
    if (const auto known = names_.find(source); known != names_.end()) {
      return {known->second, false};
    }
    fs::path file = fs::path(path).filename();
    if (!extension.empty()) file.replace_extension(extension);
    std::string name = file.string();
    for (int i = 2; !taken_.insert(name).second; ++i) {
      name = fmt::format("{}_{}{}", file.stem().string(), i, file.extension().string());
    }
    names_[source] = name;
    return {name, true};
  }

  void copy(const std::string& path, const std::string& name) {
    const MappedFile file(path);
    const auto bytes = file.bytes();
    write(name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }

  void write(const std::string& name, std::string_view text) {
    OutputFile file(folder_.file("inputs/" + name));
    file.write(text);
    file.commit();
  }

  std::string from_;
  OutputFolder& folder_;
  std::map<std::string, std::string> names_;  ///< By source.
  std::set<std::string> taken_;
};

/// `inputs` takes settings that name files: `take` each, `take_model` and `take_lidar` those that
/// may be a shipped one's name.
template <class Taker>
void take_files(Scenario& scenario, Taker& inputs) {
  for (VehicleSetup& vehicle : scenario.vehicles) {
    inputs.take_model(vehicle.model);
    for (LidarMount& mount : vehicle.lidars) {
      inputs.take_lidar(mount.model);
      inputs.take(mount.blocked);
    }
    for (CommandSettings& command : vehicle.commands) inputs.take(command.file);
  }
  for (ObstacleSettings& obstacle : scenario.obstacles) {
    inputs.take(obstacle.file);
    inputs.take(obstacle.keyframes);
  }
  for (auto& [name, settings] : scenario.sections) {
    const ScenarioSection* row = scenario_sections().find(name);
    if (row == nullptr || !row->models) continue;
    for (std::string* model : row->models(settings)) inputs.take_model(*model);
  }
}

/// Where the files are.
struct Paths {
  std::string from;
  std::vector<std::string> paths;

  void take(const std::string& setting) {
    if (!setting.empty()) paths.push_back(resolve_path(setting, from));
  }
  void take_model(const std::string& setting) {
    if (is_model_path(setting)) take(setting);
  }
  void take_lidar(const std::string& setting) { take_model(setting); }
};

/// A link to the map in the folder, or its path where the file system has no links.
std::string link_to_map(const std::string& map_path,
                        OutputFolder& folder,
                        const std::string& final_folder) {
  std::error_code error;
  const fs::path map = fs::canonical(map_path, error);
  if (error) return map_path;  // was never a file
  const fs::path target = map.lexically_relative(fs::weakly_canonical(final_folder));
  const std::string name = fs::path(map_path).filename().string();
  fs::create_symlink(target, folder.link(name), error);
  return error ? target.string() : name;
}

}  // namespace

std::vector<std::string> files_of(const Scenario& scenario) {
  Scenario copy = scenario;
  Paths paths{scenario.folder(), {}};
  take_files(copy, paths);
  return std::move(paths.paths);
}

void write_scenario_copy(const Scenario& scenario,
                         const std::string& map_hash,
                         OutputFolder& folder,
                         const std::string& final_folder) {
  Scenario copy = scenario;
  Inputs inputs(scenario.folder(), folder);
  take_files(copy, inputs);
  if (!scenario.world) {
    copy.map = link_to_map(resolve_path(scenario.map, scenario.folder()), folder, final_folder);
  }
  copy.map_hash = map_hash;
  OutputFile file(folder.file("scenario.yaml"));
  file.write(
      "# As flown; every key: docs/scenario.md. Again: pointflight fly scenario.yaml -o RUN\n" +
      scenario_yaml(copy));
  file.commit();
}

}  // namespace pointflight
