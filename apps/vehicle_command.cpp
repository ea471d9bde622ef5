#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/pictures.hpp"
#include "pointflight/core/constants.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/vehicle/step_response.hpp"

namespace pointflight::apps {
namespace {

struct ShowFlags {
  std::string name;
  std::string controller;
  std::string picture;
  bool force = false;
};

void list_vehicles() {
  for (const std::string& name : model_names("vehicles")) {
    const VehicleSettings s = load_vehicle(name);
    fmt::print("{:<12}  {} rotors  {:>5.2f} kg  {}\n", name, s.rotors.size(), s.mass, s.title);
  }
}

/// Power at the shafts in hover, W.
double hover_power(const VehicleSettings& s) {
  const double w = s.hover_speed();
  return static_cast<double>(s.rotors.size()) * s.rotor.torque_coefficient * w * w * w;
}

void show_vehicle(const ShowFlags& flags) {
  refuse_to_overwrite(flags.picture, flags.force);
  VehicleSettings s = load_vehicle(flags.name);
  if (!flags.controller.empty()) s.controller.kind = flags.controller;
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
  if (s.battery.cells > 0.0) {
    const double current = hover_power(s) / s.battery.efficiency / (s.battery.cells * 3.85);
    fmt::print("# battery: {:.0f} cells, {:.1f} Ah: about {:.0f} min of hover\n",
               s.battery.cells,
               s.battery.capacity,
               60.0 * s.battery.capacity / current);
  }
  const auto responses = step_responses(s);
  fmt::print("# loops ({}), flown from hover:\n", s.controller.kind);
  fmt::print("#   {:<15} {:>10} {:>8} {:>10} {:>8} {:>10} {:>9}\n",
             "step",
             "design",
             "damping",
             "bandwidth",
             "rise",
             "overshoot",
             "settled");
  for (const StepResponse& r : responses) {
    fmt::print("#   {:<15} {:>4.1f} rad/s {:>8} {:>4.1f} rad/s {:>6.2f} s {:>8.1f} % {:>7.2f} s\n",
               r.name,
               r.design.natural_frequency,
               r.first_order ? std::string("1st ord.") : fmt::format("{:.2f}", r.design.damping),
               r.bandwidth,
               r.rise_time,
               100.0 * r.overshoot,
               r.settling);
  }
  SettingsWriter writer;
  describe(writer, s);
  fmt::print("{}", writer.text());
  if (!flags.picture.empty()) draw_step_responses(s, responses, flags.picture);
}

}  // namespace

void add_vehicle_command(CLI::App& parent, int& /*exit_code*/) {
  auto* app = parent.add_subcommand("vehicle", "Vehicles: a YAML file each");
  app->require_subcommand(1);
  auto* list = app->add_subcommand("list", "Names of the shipped vehicles");
  list->callback([] { list_vehicles(); });
  auto* show = app->add_subcommand(
      "show", "What a vehicle's file says: hover, thrust to weight, loops, step responses");
  auto flags = std::make_shared<ShowFlags>();
  show->add_option("name", flags->name, "A shipped vehicle or the path of a .yaml file")
      ->required();
  show->add_option(
      "--controller", flags->controller, "cascade or geometric, instead of the file's");
  show->add_option("--png", flags->picture, "Draw the step responses");
  add_force_flag(*show, flags->force);
  show->callback([flags] { show_vehicle(*flags); });
}

}  // namespace pointflight::apps
