#include "apps/fly_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/run_cost.hpp"
#include "apps/settings_json.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/sim/flight_recorder.hpp"
#include "pointflight/sim/run_summary.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

/// Which limits cut what was asked for, and for how long.
void print_limits(const VehicleSummary& s) {
  std::vector<std::string> reached;
  const auto add = [&](const char* what, Duration time) {
    if (time.count() > 0) reached.push_back(fmt::format("{} for {:.2f} s", what, to_seconds(time)));
  };
  add("speed", s.speed_limited);
  add("acceleration", s.acceleration_limited);
  add("tilt", s.tilt_limited);
  add("thrust", s.rotors_limited);
  if (reached.empty()) return;
  fmt::print("  limits reached    {}\n", fmt::join(reached, ", "));
}

void print_vehicle(const Simulation& simulation, std::size_t v) {
  const VehicleSummary& s = simulation.summary(v);
  const VehicleStatus& status = simulation.status(v);
  if (simulation.vehicle_count() > 1) fmt::print("{}\n", simulation.vehicle(v).setup().name);
  fmt::print("  flown             {:.1f} m, up to {:.2f} m/s{}\n",
             s.distance_flown,
             s.speed_max,
             status.crashed ? "; crashed" : "");
  fmt::print("  scans             {}, {} points of {} beams\n",
             s.scans,
             short_count(static_cast<double>(s.points)),
             short_count(static_cast<double>(s.beams)));
  fmt::print("  closest approach  {}\n",
             s.closest_approach ? fmt::format("{} m to {} at {}",
                                              fixed_text(*s.closest_approach, 2),
                                              label_name(simulation, s.closest_label),
                                              point_text(s.closest_position_world))
                                : std::string("over 10 m"));
  fmt::print("  collisions        {}\n", s.collisions);
  fmt::print("  tracking error    {:.0f} mm RMS, {:.0f} mm at most\n",
             s.tracking_error_rms * 1e3,
             s.tracking_error_max * 1e3);
  if (s.off_track.count() > 0) {
    fmt::print("  off its way       {:.1f} s over 3 m away from where it should be\n",
               to_seconds(s.off_track));
  }
  print_limits(s);
  if (simulation.vehicle(v).setup().battery) {
    fmt::print("  battery           {:.2f} Ah used, {:.1f} V now{}{}\n",
               status.battery.used,
               status.battery.voltage,
               s.battery_low ? fmt::format("; low at {:.1f} s", to_seconds(*s.battery_low)) : "",
               s.battery_empty
                   ? fmt::format("; rotors off at {:.1f} s", to_seconds(*s.battery_empty))
                   : "");
  }
  if (status.autopilot.rejected > 0) {
    fmt::print("  commands          {} rejected; the last: {}\n",
               status.autopilot.rejected,
               status.autopilot.last_rejection);
  }
}

/// What a second of the run cost of this machine.
void print_cost(const RunCost& cost) {
  std::vector<std::string> parts;
  double rest = cost.cores;
  for (const RunCost::Lidar& lidar : cost.lidars) {
    rest -= lidar.cores;
    parts.push_back(fmt::format("{}{} {:.2f}",
                                lidar.count > 1 ? fmt::format("{} x ", lidar.count) : "",
                                fs::path(lidar.model).stem().string(),
                                lidar.cores));
  }
  parts.push_back(fmt::format("all else {:.2f}", std::max(0.0, rest)));
  fmt::print("  cost              {:.2f} of a core for a simulated second: {}\n",
             cost.cores,
             fmt::join(parts, ", "));
}

}  // namespace

void print_result(const FlightReport& report, const Simulation& simulation, const RunLoop& loop) {
  const RunCost cost = cost_of(simulation, loop);
  if (report.json) {
    auto json = nlohmann::ordered_json::parse(summary_json(simulation));
    if (!report.output.empty()) json["folder"] = report.output;
    json["real_time_factor"] = cost.real_time_factor;
    json["cost"] = json_of(cost);
    print_json(json);
    return;
  }
  fmt::print("{}\n", report.output.empty() ? report.input : report.output);
  const std::string reason = reason_of(simulation.end());
  fmt::print("  end               {}, after {:.1f} s{}\n",
             to_string(simulation.end()),
             to_seconds(simulation.time()),
             reason.empty() ? "" : ": " + reason);
  for (const std::size_t v : simulation.flying_here()) print_vehicle(simulation, v);
  fmt::print("  real-time factor  {:.1f}\n", cost.real_time_factor);
  print_cost(cost);
  if (report.output.empty() || !report.has_picture) return;
  fmt::print("  picture           {}\n", (fs::path(report.output) / "overview.png").string());
}

}  // namespace pointflight::apps
