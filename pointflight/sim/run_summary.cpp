#include "pointflight/sim/run_summary.hpp"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "pointflight/core/version.hpp"
#include "pointflight/sim/flight_recorder.hpp"
#include "pointflight/sim/interrupted_run.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

nlohmann::ordered_json json_of(const Vector3d& v) {
  return nlohmann::ordered_json::array({v.x(), v.y(), v.z()});
}

nlohmann::ordered_json json_of(const Simulation& simulation, std::size_t number) {
  const VehicleAgent& agent = simulation.vehicle(number);
  const VehicleStatus& status = simulation.status(number);
  const VehicleSummary& s = status.summary;
  nlohmann::ordered_json json;
  json["name"] = agent.setup().name;
  json["model"] = fs::path(agent.setup().model).filename().string();
  json["label"] = agent.label();
  json["distance_flown"] = s.distance_flown;
  json["mission_length"] = agent.mission().length();
  json["speed_max"] = s.speed_max;
  json["tracking_error_rms"] = s.tracking_error_rms;
  json["tracking_error_max"] = s.tracking_error_max;
  json["off_track_time"] = to_seconds(s.off_track);
  json["states"] = s.states;
  json["imu_samples"] = s.imu_samples;
  json["scans"] = s.scans;
  json["beams"] = s.beams;
  json["points"] = s.points;
  json["collisions"] = s.collisions;
  json["crashed"] = status.crashed;
  if (s.closest_approach) {
    json["closest_approach"] = *s.closest_approach;
    json["closest_place"] = json_of(s.closest_position_world);
    json["closest_to"] = label_name(simulation, s.closest_label);
  } else {
    json["closest_approach"] = nullptr;
  }
  json["commands_rejected"] = status.autopilot.rejected;
  json["command_timeouts"] = status.autopilot.timeouts;
  const auto time_or_null = [](const std::optional<SimTime>& time) {
    return time ? nlohmann::ordered_json(to_seconds(*time)) : nlohmann::ordered_json(nullptr);
  };
  if (agent.setup().battery) {
    json["battery_used_ah"] = status.battery.used;
    json["battery_low_at"] = time_or_null(s.battery_low);
    json["battery_empty_at"] = time_or_null(s.battery_empty);
  }
  if (s.rotor_lost) json["rotor_lost_at"] = time_or_null(s.rotor_lost);
  json["trajectories_beyond_limits"] = s.beyond_limits;
  json["limited_time"] = {{"speed", to_seconds(s.speed_limited)},
                          {"acceleration", to_seconds(s.acceleration_limited)},
                          {"tilt", to_seconds(s.tilt_limited)},
                          {"rotors", to_seconds(s.rotors_limited)}};
  return json;
}

/// A vehicle that another process flew.
nlohmann::ordered_json json_of(const Simulation& simulation, const SourceReport& other) {
  nlohmann::ordered_json json;
  json["name"] = simulation.vehicle(other.vehicle).setup().name;
  json["flown_by"] = other.flown_by;
  json["losses"] = other.losses;
  json["time_apart"] = to_seconds(other.apart);
  json["missed_contacts"] = other.missed_contacts;
  json["unknown_contacts"] = other.unknown_contacts;
  json["extrapolated_max"] = other.extrapolated_max;
  json["extrapolation_bound"] = other.extrapolation_bound;
  return json;
}

}  // namespace

std::string summary_json(const Simulation& simulation) {
  const Scenario& scenario = simulation.scenario();
  nlohmann::ordered_json json;
  json["pointflight"] = kVersion;
  json["end"] = to_string(simulation.end());
  const std::string reason = reason_of(simulation.end());
  if (!reason.empty()) json["end_reason"] = reason;
  json["seed"] = scenario.seed;
  json["map"] = scenario.world ? scenario.map_name() : fs::path(scenario.map).filename().string();
  json["map_bytes"] = simulation.map().file_size();
  json["map_hash"] = simulation.map().hash();
  // divided and not multiplied: 0.3 and not 0.30000000000000004
  json["simulated_time"] = static_cast<double>(simulation.time().time_since_epoch().count()) / 1e9;
  json["obstacles"] = simulation.obstacle_count();
  json["vehicles"] = nlohmann::ordered_json::array();
  for (const std::size_t v : simulation.flying_here()) {
    json["vehicles"].push_back(json_of(simulation, v));
  }
  if (simulation.ends_by_agreement()) {
    json["skipped_time"] = to_seconds(simulation.state().skipped);
    json["others"] = nlohmann::ordered_json::array();
    for (const SourceReport& other : simulation.source_reports()) {
      json["others"].push_back(json_of(simulation, other));
    }
  }
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace pointflight
