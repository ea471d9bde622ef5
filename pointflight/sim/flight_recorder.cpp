#include "pointflight/sim/flight_recorder.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/version.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

/// Makes the folder for the run's files and one for its scans; returns the first.
std::string make_folders(const std::string& folder, bool scans) {
  std::error_code error;
  const fs::path innermost = scans ? fs::path(folder) / "scans" : fs::path(folder);
  fs::create_directories(innermost, error);
  if (error) {
    throw InputError(fmt::format(
        "{}: cannot make the folder: {}; choose another with -o", folder, error.message()));
  }
  return folder;
}

/// Seconds with nine digits: exact.
std::string seconds(SimTime time) {
  const std::int64_t ns = time.time_since_epoch().count();
  return fmt::format("{}.{:09}", ns / 1'000'000'000, ns % 1'000'000'000);
}

std::string csv(const Vector3d& v) {
  return fmt::format("{},{},{}", v.x(), v.y(), v.z());
}

nlohmann::ordered_json json_of(const Vector3d& v) {
  return nlohmann::ordered_json::array({v.x(), v.y(), v.z()});
}

std::string at(const std::string& folder, const char* name) {
  return (fs::path(folder) / name).string();
}

}  // namespace

FlightRecorder::FlightRecorder(const std::string& folder,
                               const Scenario& scenario,
                               std::size_t rotors)
    : folder_(make_folders(folder, scenario.output.scans)),
      write_scans_(scenario.output.scans),
      trajectory_(at(folder, "trajectory.csv")),
      tum_(at(folder, "trajectory.tum")),
      events_(at(folder, "events.csv")),
      scans_(at(folder, "scans.csv")) {
  trajectory_.write(
      "time,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz,command_px,command_py,command_pz,clearance");
  for (std::size_t i = 0; i < rotors; ++i) trajectory_.write(fmt::format(",rotor{}", i));
  trajectory_.write("\n");
  tum_.write("# timestamp tx ty tz qx qy qz qw (T_world_body)\n");
  events_.write("time,event,vehicle_x,vehicle_y,vehicle_z,place_x,place_y,place_z,penetration\n");
  scans_.write("file,lidar,scan,start,end,beams,points\n");
  if (scenario.output.imu) {
    imu_.emplace(at(folder, "imu.csv"));
    imu_->write("time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n");
  }
}

void FlightRecorder::on_state(const StateSample& sample) {
  const RigidBodyState& b = sample.state.body;
  const Quaterniond& q = b.q_world_body;
  const std::string time = seconds(sample.time);
  std::string row = fmt::format("{},{},{},{},{},{},{},{},{},",
                                time,
                                csv(b.p_world),
                                q.w(),
                                q.x(),
                                q.y(),
                                q.z(),
                                csv(b.v_world),
                                csv(b.omega_body),
                                csv(sample.command.p_world));
  // empty: farther than the simulation looks
  if (sample.clearance) row += fmt::format("{}", *sample.clearance);
  for (const RotorState& rotor : sample.state.rotors) row += fmt::format(",{}", rotor.speed);
  trajectory_.write(row + "\n");
  tum_.write(fmt::format("{} {} {} {} {} {} {} {}\n",
                         time,
                         b.p_world.x(),
                         b.p_world.y(),
                         b.p_world.z(),
                         q.x(),
                         q.y(),
                         q.z(),
                         q.w()));
}

void FlightRecorder::on_imu(const ImuSample& sample) {
  if (!imu_) return;
  imu_->write(fmt::format("{},{},{}\n", seconds(sample.time), csv(sample.gyro), csv(sample.accel)));
}

void FlightRecorder::on_scan(const Scan& scan, const PoseAt& /*pose_at*/) {
  if (!write_scans_) return;
  const std::string name = fmt::format("scans/{}_{:06}.pcd", scan.sensor, scan.index);
  write_scan_pcd(at(folder_, name.c_str()), scan);
  scans_.write(fmt::format("{},{},{},{},{},{},{}\n",
                           name,
                           scan.sensor,
                           scan.index,
                           seconds(scan.start),
                           seconds(scan.end),
                           scan.beams,
                           scan.points.size()));
}

void FlightRecorder::on_collision(const CollisionEvent& event) {
  events_.write(fmt::format("{},{},{},{},{}\n",
                            seconds(event.time),
                            event.entered ? "collision" : "collision_end",
                            csv(event.vehicle_world),
                            csv(event.place_world),
                            event.penetration));
}

void FlightRecorder::finish(const Simulation& simulation) {
  trajectory_.commit();
  tum_.commit();
  if (imu_) imu_->commit();
  events_.commit();
  scans_.commit();
  OutputFile summary(at(folder_, "summary.json"));
  summary.write(summary_json(simulation));
  summary.commit();
}

std::string summary_json(const Simulation& simulation) {
  const RunSummary& s = simulation.summary();
  const Scenario& scenario = simulation.scenario();
  nlohmann::ordered_json json;
  json["pointflight"] = kVersion;
  json["end"] = to_string(s.end);
  json["seed"] = scenario.seed;
  json["map"] = fs::path(scenario.map).filename().string();
  json["vehicle"] = scenario.vehicle.model;
  json["simulated_time"] = to_seconds(s.time);
  json["distance_flown"] = s.distance_flown;
  json["mission_length"] = simulation.mission().length();
  json["speed_max"] = s.speed_max;
  json["tracking_error_rms"] = s.tracking_error_rms;
  json["tracking_error_max"] = s.tracking_error_max;
  json["states"] = s.states;
  json["imu_samples"] = s.imu_samples;
  json["scans"] = s.scans;
  json["beams"] = s.beams;
  json["points"] = s.points;
  json["collisions"] = s.collisions;
  if (s.closest_approach) {
    json["closest_approach"] = *s.closest_approach;
    json["closest_place"] = json_of(s.closest_place_world);
  } else {
    json["closest_approach"] = nullptr;
  }
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace pointflight
