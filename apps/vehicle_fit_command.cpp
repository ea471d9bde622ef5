#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/settings_json.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/flight_log/vehicle_fit.hpp"
#include "pointflight/vehicle/motor_outputs.hpp"

namespace pointflight::apps {
namespace {

struct VehicleFitFlags {
  std::string log;
  std::string like;
  std::string output;
  double from = 0.0;
  double until = std::numeric_limits<double>::infinity();
  double mass = 0.0;  ///< 0: the file's.
  bool json = false;
  bool force = false;
  int threads = 0;
};

nlohmann::ordered_json json_of_vector(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

void print_fit_json(const FlightLog& log, const VehicleFit& fit) {
  nlohmann::ordered_json json;
  json["log"] = log.path;
  json["firmware"] = log.firmware;
  json["flown"] = fit.flown;
  for (const FittedFigure& figure : fit.figures) {
    nlohmann::ordered_json& row = json["figures"].emplace_back();
    row["key"] = figure.key;
    row["unit"] = figure.unit;
    row["before"] = figure.before;
    row["value"] = figure.value;
    row["sigma"] = figure.sigma;
    row["told"] = figure.is_told;
    if (!figure.remark.empty()) row["remark"] = figure.remark;
  }
  json["accel_rms"] = {{"before", json_of_vector(fit.before.accel)},
                       {"after", json_of_vector(fit.after.accel)}};
  json["gyro_rms"] = {{"before", json_of_vector(fit.before.gyro)},
                      {"after", json_of_vector(fit.after.gyro)}};
  json["thrust_to_weight"] = fit.vehicle.thrust_to_weight();
  json["hover_output"] = MotorOutputs(fit.vehicle).hover();
  print_json(json);
}

void print_fit(const FlightLog& log, const VehicleFit& fit) {
  fmt::print("{}: {}, {:.0f} s of flight; outputs ({}) at {:.0f} Hz, IMU at {:.0f} Hz\n",
             log.path,
             log.firmware,
             fit.flown,
             log.outputs_from,
             rate_of(log.outputs),
             rate_of(log.imu));
  fmt::print("{:<26} {:>11} {:>11} {:>10}\n", "", "before", "fitted", "+- (1 s.d.)");
  for (const FittedFigure& f : fit.figures) {
    if (f.is_told) {
      fmt::print(
          "{:<26} {:>11.4g} {:>11.4g} {:>10.2g}  {}\n", f.key, f.before, f.value, f.sigma, f.unit);
    } else {
      fmt::print("{:<26} {:>11.4g} {:>11} {:>10}  {}: {}\n",
                 f.key,
                 f.before,
                 "kept",
                 "",
                 f.unit,
                 f.remark);
    }
  }
  fmt::print("mass {:g} kg and greatest speed {:g} rad/s are not in a log: the file's, or --mass\n",
             fit.vehicle.mass,
             fit.vehicle.rotor.speed_max);
  fmt::print("thrust to weight {:.2f}, hover at output {:.3f}\n",
             fit.vehicle.thrust_to_weight(),
             MotorOutputs(fit.vehicle).hover());
  const auto rms = [](const char* what, const Vector3d& a, const Vector3d& b, const char* unit) {
    fmt::print("off by (rms) {:<15} {:.3f} {:.3f} {:.3f} -> {:.3f} {:.3f} {:.3f} {}\n",
               what,
               a.x(),
               a.y(),
               a.z(),
               b.x(),
               b.y(),
               b.z(),
               unit);
  };
  rms("specific force", fit.before.accel, fit.after.accel, "m/s^2");
  rms("rates in 0.5 s", fit.before.gyro, fit.after.gyro, "rad/s");
}

/// The vehicle file: what was fitted is said on top.
std::string vehicle_text(VehicleSettings vehicle,
                         const VehicleSettings& like,
                         const FlightLog& log) {
  vehicle.source = fmt::format("{} (pointflight vehicle fit {}); before: {}",
                               "thrust, lag, drag and inertia fitted to a log",
                               std::filesystem::path(log.path).filename().string(),
                               like.source);
  vehicle.title = like.title + ", fitted";
  SettingsWriter writer;
  describe(writer, vehicle);
  return writer.text();
}

void fit(const VehicleFitFlags& flags) {
  VehicleSettings like = load_vehicle(flags.like);
  check_outputs({flags.output}, {flags.log, like.path}, flags.force);
  if (flags.mass > 0.0) {
    // what it weighs more it also holds more of against turning, and needs more thrust for
    const double share = flags.mass / like.mass;
    like.mass = flags.mass;
    like.inertia_diagonal *= share;
  }
  const FlightLog log = read_flight_log(flags.log);
  const Executor executor(flags.threads);
  VehicleFitOptions options{flags.from, flags.until, terminal_progress()};
  const VehicleFit fit = fit_vehicle(log, like, executor, options);
  end_progress();
  if (!flags.output.empty()) {
    OutputFile file(flags.output);
    file.write(vehicle_text(fit.vehicle, like, log));
    file.commit();
  }
  if (flags.json) {
    print_fit_json(log, fit);
  } else {
    print_fit(log, fit);
  }
}

}  // namespace

void add_vehicle_fit_command(CLI::App& vehicle) {
  auto* app = vehicle.add_subcommand(
      "fit",
      "A vehicle file from a log of PX4 (.ulg) or ArduPilot (.bin): thrust, lag, drag, inertia");
  auto flags = std::make_shared<VehicleFitFlags>();
  app->add_option("log", flags->log, "The log of a flight")->required();
  app->add_option("--like",
                  flags->like,
                  "Vehicle whose rotors, mass and the rest it has: a shipped one or a .yaml file")
      ->required();
  app->add_option("-o,--output", flags->output, "Vehicle file to write");
  app->add_option("--mass", flags->mass, "Of the vehicle that flew, kg; the file's without it")
      ->check(within(0.01, 1000.0));
  app->add_option("--from", flags->from, "Part of the log, s of its own time")
      ->check(within(0.0, 1e7));
  app->add_option("--until", flags->until, "The same")->check(within(0.0, 1e7));
  app->add_option("--threads", flags->threads, "0: all cores; results never depend on it")
      ->check(CLI::Range(0, 1024));
  app->add_flag("--json", flags->json, "JSON on stdout");
  add_force_flag(*app, flags->force);
  app->footer("Example: pointflight vehicle fit flight.ulg --like x500 -o mine.yaml");
  app->callback([flags] { fit(*flags); });
}

}  // namespace pointflight::apps
