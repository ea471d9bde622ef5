#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/settings_json.hpp"
#include "pointflight/core/constants.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/picture/pictures.hpp"
#include "pointflight/sitl/ardupilot_parameters.hpp"
#include "pointflight/sitl/px4_airframe.hpp"
#include "pointflight/sitl/px4_parameters.hpp"
#include "pointflight/vehicle/step_response.hpp"

namespace pointflight::apps {
namespace {

struct ShowFlags {
  std::string name;
  std::string controller;
  std::string picture;
  bool force = false;
  bool json = false;
  bool path = false;  ///< Nothing but where the file lies.
};

void list_vehicles(const ShowFlags& flags) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const std::string& name : model_names("vehicles")) {
    const VehicleSettings s = load_vehicle(name);
    if (flags.json) {
      json.push_back({{"name", name},
                      {"title", s.title},
                      {"rotors", s.rotors.size()},
                      {"mass", s.mass},
                      {"path", s.path}});
      continue;
    }
    fmt::print("{:<12}  {} rotors  {:>5.2f} kg  {}\n", name, s.rotors.size(), s.mass, s.title);
  }
  if (flags.json) print_json(json);
}

/// Power at the shafts in hover, W.
double hover_power(const VehicleSettings& s) {
  const double w = s.hover_speed();
  return static_cast<double>(s.rotors.size()) * s.rotor.torque_coefficient * w * w * w;
}

/// How long the battery lasts in hover, s; nothing without one.
std::optional<double> hover_time(const VehicleSettings& s) {
  if (s.battery.cells <= 0.0) return std::nullopt;
  constexpr double kCellVoltage = 3.85;  // half full
  const double current = hover_power(s) / s.battery.efficiency / (s.battery.cells * kCellVoltage);
  return 3600.0 * s.battery.capacity / current;
}

nlohmann::ordered_json json_of(const StepResponse& r) {
  nlohmann::ordered_json json;
  json["step"] = r.name;
  json["design_natural_frequency"] = r.design.natural_frequency;
  if (!r.first_order) json["design_damping"] = r.design.damping;
  json["bandwidth"] = r.bandwidth;
  json["rise_time"] = r.rise_time;
  json["overshoot"] = r.overshoot;
  json["settling_time"] = r.settling;
  return json;
}

void print_json_of(VehicleSettings& s, const std::vector<StepResponse>& responses) {
  nlohmann::ordered_json json;
  json["path"] = s.path;
  json["hover"] = {{"rotor_speed", s.hover_speed()},
                   {"shaft_power", hover_power(s)},
                   {"thrust_to_weight", s.thrust_to_weight()}};
  if (const auto time = hover_time(s)) json["hover"]["time"] = *time;
  json["hull_radius"] = bounding_radius(s.hull());
  for (const StepResponse& r : responses) json["responses"].push_back(json_of(r));
  json["settings"] = json_of_settings(s);
  print_json(json);
}

void print_vehicle(VehicleSettings& s, const std::vector<StepResponse>& responses) {
  const double hover = s.hover_speed();
  fmt::print("# {}\n", s.path);
  fmt::print("# hover: {:.0f} rad/s of {:.0f} ({:.0f} % of the speed, {:.0f} % of the thrust)\n",
             hover,
             s.rotor.speed_max,
             100.0 * hover / s.rotor.speed_max,
             100.0 / s.thrust_to_weight());
  fmt::print("# thrust to weight: {:.2f}; hull reaches {:.2f} m; shaft power in hover: {:.0f} W\n",
             s.thrust_to_weight(),
             bounding_radius(s.hull()),
             hover_power(s));
  if (const auto time = hover_time(s)) {
    fmt::print("# battery: {:.0f} cells, {:.1f} Ah: about {:.0f} min of hover\n",
               s.battery.cells,
               s.battery.capacity,
               *time / 60.0);
  }
  fmt::print("# loops ({}), flown from hover:\n", s.controller.kind->name);
  fmt::print("#   {:<15} {:>10} {:>8} {:>10} {:>8} {:>10} {:>9}\n",
             "step",
             "design",
             "damping",
             "bandwidth",
             "rise",
             "overshoot",
             "settled");
  for (const StepResponse& r : responses) {
    fmt::print("#   {:<15} {:>4.1f} rad/s {:>8} {:>4.1f} rad/s {:>6.2f} s {:>8} % {:>7.2f} s\n",
               r.name,
               r.design.natural_frequency,
               r.first_order ? std::string("1st ord.") : fmt::format("{:.2f}", r.design.damping),
               r.bandwidth,
               r.rise_time,
               fixed_text(100.0 * r.overshoot, 1),
               r.settling);
  }
  SettingsWriter writer;
  describe(writer, s);
  fmt::print("{}", writer.text());
}

void show_vehicle(const ShowFlags& flags) {
  VehicleSettings s = load_vehicle(flags.name);
  check_outputs({flags.picture}, {s.path}, flags.force);
  if (!flags.controller.empty()) s.controller.kind = flags.controller;
  if (flags.path) {
    fmt::print("{}\n", s.path);
    return;
  }
  const auto responses = step_responses(s);
  if (flags.json) {
    print_json_of(s, responses);
  } else {
    print_vehicle(s, responses);
  }
  if (!flags.picture.empty()) picture::draw_step_responses(s, responses, flags.picture);
}

struct ParameterFlags {
  std::string name;
  std::string output;
  bool vision = false;
  bool force = false;
};

void write_parameters(const ParameterFlags& flags,
                      const std::string& text,
                      const VehicleSettings& vehicle) {
  if (flags.output.empty()) {
    fmt::print("{}", text);
    return;
  }
  check_outputs({flags.output}, {vehicle.path}, flags.force);
  OutputFile file(flags.output);
  file.write(text);
  file.commit();
}

CLI::App* add_parameters(CLI::App& parent,
                         const std::string& command,
                         const std::string& help,
                         const std::shared_ptr<ParameterFlags>& flags) {
  auto* app = parent.add_subcommand(command, help);
  app->add_option("name", flags->name, "A shipped vehicle or the path of a .yaml file")->required();
  app->add_option("-o,--output", flags->output, "Parameter file; without it: stdout");
  add_force_flag(*app, flags->force);
  return app;
}

void add_firmware_commands(CLI::App& parent) {
  auto px4 = std::make_shared<ParameterFlags>();
  auto* app =
      add_parameters(parent,
                     "px4-params",
                     "A vehicle as parameters of PX4: rotors, thrust, gains (docs/autopilots.md)",
                     px4);
  app->add_flag("--vision", px4->vision, "To fly by external vision, without satellites");
  app->callback([px4] {
    const VehicleSettings vehicle = load_vehicle(px4->name);
    write_parameters(*px4, px4_parameter_file(vehicle, px4->vision), vehicle);
  });
  auto ardupilot = std::make_shared<ParameterFlags>();
  app = add_parameters(parent,
                       "ardupilot-params",
                       "A quadrotor as parameters of ArduCopter: frame, thrust, gains "
                       "(docs/autopilots.md)",
                       ardupilot);
  app->callback([ardupilot] {
    const VehicleSettings vehicle = load_vehicle(ardupilot->name);
    write_parameters(*ardupilot, ardupilot_parameter_file(vehicle), vehicle);
  });
}

struct ImportFlags {
  std::string airframe;
  std::string like;
  std::string output;
  bool force = false;
};

void import_vehicle(const ImportFlags& flags) {
  const VehicleSettings like = load_vehicle(flags.like);
  check_outputs({flags.output}, {flags.airframe, like.path}, flags.force);
  const MappedFile file(flags.airframe);
  VehicleSettings vehicle = vehicle_from_px4_airframe(file.text(), flags.airframe, like);
  SettingsWriter writer;
  describe(writer, vehicle);
  OutputFile output(flags.output);
  output.write(writer.text());
  output.commit();
}

void add_import_command(CLI::App& parent) {
  auto* app = parent.add_subcommand(
      "import", "A vehicle file with the rotors of one of PX4's airframes (docs/autopilots.md)");
  auto flags = std::make_shared<ImportFlags>();
  app->add_option("--px4-airframe",
                  flags->airframe,
                  "Start script of PX4 (param set-default CA_ROTOR0_PX ...) or parameter file")
      ->required();
  app->add_option("--like",
                  flags->like,
                  "Vehicle whose mass, thrust and the rest it has: a shipped one or a .yaml file")
      ->required();
  app->add_option("-o,--output", flags->output, "Vehicle file to write")->required();
  add_force_flag(*app, flags->force);
  app->callback([flags] { import_vehicle(*flags); });
}

}  // namespace

void add_vehicle_command(CLI::App& parent, int& /*exit_code*/) {
  auto* app = parent.add_subcommand("vehicle", "Vehicles: a YAML file each");
  app->require_subcommand(1);
  auto* list = app->add_subcommand("list", "Names of the shipped vehicles");
  auto flags = std::make_shared<ShowFlags>();
  list->add_flag("--json", flags->json, "JSON on stdout");
  list->callback([flags] { list_vehicles(*flags); });
  auto* show = app->add_subcommand(
      "show", "What a vehicle's file says: hover, thrust to weight, loops, step responses");
  show->add_option("name", flags->name, "A shipped vehicle or the path of a .yaml file")
      ->required();
  show->add_option(
      "--controller", flags->controller, "cascade or geometric, instead of the file's");
  show->add_option("--png", flags->picture, "Draw the step responses");
  show->add_flag("--json", flags->json, "JSON on stdout");
  show->add_flag("--path", flags->path, "Say where its file lies, to copy it");
  add_force_flag(*show, flags->force);
  show->callback([flags] { show_vehicle(*flags); });
  add_firmware_commands(*app);
  add_import_command(*app);
  add_vehicle_fit_command(*app);
  auto* keys = app->add_subcommand(
      "keys", "All keys of a vehicle file as a Markdown table (docs/vehicles.md)");
  keys->callback([] { print_reference(vehicle_reference()); });
}

}  // namespace pointflight::apps
