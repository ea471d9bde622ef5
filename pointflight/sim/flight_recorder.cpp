#include "pointflight/sim/flight_recorder.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/sim/interrupted_run.hpp"
#include "pointflight/sim/run_summary.hpp"
#include "pointflight/sim/scenario_copy.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

/// Seconds with nine digits: exact.
std::string seconds(SimTime time) {
  const std::int64_t ns = time.time_since_epoch().count();
  return fmt::format("{}.{:09}", ns / 1'000'000'000, ns % 1'000'000'000);
}

std::string csv(const Vector3d& v) {
  return fmt::format("{},{},{}", v.x(), v.y(), v.z());
}

std::string row_of(const RigidBodyState& b) {
  const Quaterniond& q = b.q_world_body;
  return fmt::format("{},{},{},{},{},{},{}",
                     csv(b.p_world),
                     q.w(),
                     q.x(),
                     q.y(),
                     q.z(),
                     csv(b.v_world),
                     csv(b.omega_body));
}

/// `vehicle_name`: of a vehicle by number.
template <class VehicleName>
std::string label_name(Label label, const VehicleName& vehicle_name) {
  if (label == kMapLabel) return "map";
  if (label >= kFirstObstacle) return fmt::format("obstacle {}", label - kFirstObstacle);
  return vehicle_name(label - kFirstVehicle);
}

constexpr Duration kFlushPeriod = std::chrono::milliseconds(100);
constexpr const char* kStateColumns = "px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz";
constexpr const char* kTrueStateColumns =
    "true_px,true_py,true_pz,true_qw,true_qx,true_qy,true_qz,"
    "true_vx,true_vy,true_vz,true_wx,true_wy,true_wz";

}  // namespace

/// What one vehicle's samples go to.
struct FlightRecorder::VehicleFiles {
  VehicleFiles(RunFolder& run, std::string in, const OutputSetup& output)
      : folder(std::move(in)),
        trajectory(run.file(folder + "trajectory.csv")),
        tum(run.file(folder + "trajectory.tum")),
        scans(run.file(folder + "scans.csv")) {
    if (output.imu) imu.emplace(run.file(folder + "imu.csv"));
    if (output.odometry) odometry.emplace(run.file(folder + "odometry.csv"));
  }

  void commit() {
    trajectory.commit();
    tum.commit();
    scans.commit();
    if (imu) imu->commit();
    if (odometry) odometry->commit();
    for (auto& [number, file] : sensors) file.commit();
  }

  std::string folder;  ///< In the run's: empty, or a name and a slash.
  OutputFile trajectory;
  SimTime flushed;  ///< The trajectory, last.
  OutputFile tum;
  OutputFile scans;
  std::optional<OutputFile> imu;
  bool stamps_imu = false;  ///< Its IMU's clock errs: a column says what it says.
  std::optional<OutputFile> odometry;
  bool odometry_errs = false;                   ///< Columns with the truth come beside.
  std::map<std::uint32_t, OutputFile> sensors;  ///< By `Measurement::sensor`.
};

std::map<std::size_t, std::string> sensor_files(const VehicleAgent& vehicle) {
  std::map<std::size_t, std::string> files;
  std::map<std::string, int> alike;
  for (std::size_t i = 0; i < vehicle.sensors().size(); ++i) {
    const SensorKind* kind = vehicle.sensors()[i].kind;
    if (kind == nullptr) continue;
    const int before = alike[kind->name]++;
    files[i] = before == 0 ? kind->name + ".csv" : fmt::format("{}_{}.csv", kind->name, before);
  }
  return files;
}

void FlightRecorder::add_sensor_files(const VehicleAgent& vehicle, VehicleFiles& files) {
  for (const auto& [number, name] : sensor_files(vehicle)) {
    OutputFile file(folder_.file(files.folder + name));
    std::string header = "time,delivered";
    for (const SensorColumn& column : vehicle.sensors()[number].kind->columns) {
      header += "," + column.name;
    }
    file.write(header + "\n");
    files.sensors.emplace(static_cast<std::uint32_t>(number), std::move(file));
  }
}

std::string label_name(const Simulation& simulation, Label label) {
  return label_name(label, [&](std::size_t v) { return simulation.vehicle(v).setup().name; });
}

FlightRecorder::FlightRecorder(const std::string& folder,
                               const Simulation& simulation,
                               Existing existing)
    : folder_(folder, existing),
      write_scans_(simulation.scenario().output.scans),
      is_shared_(simulation.ends_by_agreement()),
      events_(path_for("events.csv")) {
  if (!is_shared_) folder_.forget_killed();  // nobody goes on from it
  write_scenario_copy(simulation.scenario(), simulation.map().hash(), folder_, folder_.path());
  const OutputSetup& output = simulation.scenario().output;
  events_.write(
      "time,event,vehicle,partner,vehicle_x,vehicle_y,vehicle_z,place_x,place_y,place_z,"
      "penetration\n");
  if (!simulation.scenario().obstacles.empty()) {
    obstacles_.emplace(path_for("obstacles.csv"));
    obstacles_->write("time,label,px,py,pz,qw,qx,qy,qz,half_x,half_y,half_z\n");
  }
  for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
    names_.push_back(simulation.vehicle(v).setup().name);
    if (!simulation.flies_here(v)) {
      vehicles_.push_back(nullptr);  // another process writes it
      continue;
    }
    auto files = std::make_unique<VehicleFiles>(
        folder_, simulation.vehicle_count() == 1 ? "" : names_.back() + "/", output);
    files->trajectory.write(
        fmt::format("time,{},command_px,command_py,command_pz,clearance,nearest", kStateColumns));
    for (std::size_t i = 0; i < simulation.status(v).state.rotors.size(); ++i) {
      files->trajectory.write(fmt::format(",rotor{}", i));
    }
    files->trajectory.write("\n");
    files->tum.write("# timestamp tx ty tz qx qy qz qw (T_world_body)\n");
    files->scans.write("file,lidar,scan,start,end,beams,points,px,py,pz,qw,qx,qy,qz\n");
    if (files->imu) {
      files->stamps_imu = simulation.vehicle(v).settings().imu.in_use().clock_errs();
      files->imu->write("time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z");
      files->imu->write(files->stamps_imu ? ",stamp\n" : "\n");
    }
    if (files->odometry) {
      files->odometry_errs = !simulation.vehicle(v).setup().odometry.is_true();
      files->odometry->write(fmt::format("time,delivered,{}", kStateColumns));
      files->odometry->write(files->odometry_errs ? fmt::format(",{}\n", kTrueStateColumns)
                                                  : std::string("\n"));
    }
    add_sensor_files(simulation.vehicle(v), *files);
    vehicles_.push_back(std::move(files));
  }
}

FlightRecorder::~FlightRecorder() = default;

std::string FlightRecorder::path_for(const std::string& name) {
  return folder_.file(name);
}

FlightRecorder::VehicleFiles& FlightRecorder::files_of(std::uint32_t vehicle) const {
  require_argument(vehicle < vehicles_.size() && vehicles_[vehicle],
                   "FlightRecorder: a sample of a vehicle that does not fly in its run");
  return *vehicles_[vehicle];
}

void FlightRecorder::on_sample(const Sample& sample) {
  if (is_finished_) throw std::logic_error("FlightRecorder: a sample after finish()");
  std::visit([this](const auto& s) { write(s); }, sample);
}

void FlightRecorder::write(const StateSample& sample) {
  VehicleFiles& files = files_of(sample.vehicle);
  const RigidBodyState& b = sample.state.body;
  const Quaterniond& q = b.q_world_body;
  const std::string time = seconds(sample.time);
  std::string row = fmt::format("{},{},{},", time, row_of(b), csv(sample.command.p_world));
  // empty: farther than the simulation looks
  row += sample.nearest ? fmt::format("{},{}", sample.nearest->distance, sample.nearest->label)
                        : std::string(",");
  for (const RotorState& rotor : sample.state.rotors) row += fmt::format(",{}", rotor.speed);
  files.trajectory.write(row + "\n");
  if (is_shared_) keep_up(files, sample);
  files.tum.write(fmt::format("{} {} {} {} {} {} {} {}\n",
                              time,
                              b.p_world.x(),
                              b.p_world.y(),
                              b.p_world.z(),
                              q.x(),
                              q.y(),
                              q.z(),
                              q.w()));
}

/// What a process needs that goes on where this one is killed (`ended_run`).
void FlightRecorder::keep_up(VehicleFiles& files, const StateSample& sample) {
  if (sample.time < files.flushed + kFlushPeriod) return;
  files.trajectory.flush();
  // the first rows of all vehicles are there: from now on this run is what one goes on from
  if (files.flushed > SimTime{}) folder_.forget_killed();
  files.flushed = sample.time;
  if (skipped_ == sample.skipped) return;
  skipped_ = sample.skipped;
  std::ofstream(path_for(kSkippedFile)) << skipped_.count() << '\n';
}

void FlightRecorder::write(const OdometrySample& sample) {
  VehicleFiles& files = files_of(sample.vehicle);
  if (!files.odometry) return;
  files.odometry->write(fmt::format(
      "{},{},{}", seconds(sample.time), seconds(sample.delivered), row_of(sample.state)));
  files.odometry->write(files.odometry_errs ? "," + row_of(sample.truth) + "\n" : "\n");
}

void FlightRecorder::write(const ImuSample& sample) {
  VehicleFiles& files = files_of(sample.vehicle);
  auto& imu = files.imu;
  if (!imu) return;
  imu->write(fmt::format("{},{},{}", seconds(sample.time), csv(sample.gyro), csv(sample.accel)));
  imu->write(files.stamps_imu ? fmt::format(",{}\n", seconds(sample.stamp)) : std::string("\n"));
}

/// One row; its file begins with the kind's columns.
void FlightRecorder::write(const Measurement& sample) {
  std::string row = fmt::format("{},{}", seconds(sample.time), seconds(sample.delivered));
  for (const double value : sample.values) row += fmt::format(",{}", value);
  auto& files = files_of(sample.vehicle).sensors;
  const auto file = files.find(sample.sensor);
  if (file == files.end()) {
    throw std::invalid_argument(fmt::format(
        "a measurement of sensor {}; a sensor's number is that of its SensorSite", sample.sensor));
  }
  file->second.write(row + "\n");
}

void FlightRecorder::write(const ScanSample& sample) {
  if (!write_scans_) return;
  const Scan& scan = *sample.scan;
  VehicleFiles& files = files_of(scan.vehicle);
  const std::string name = fmt::format("scans/{}_{:06}.pcd", scan.sensor, scan.index);
  write_scan_pcd(folder_.file(files.folder + name), scan);
  // T_world_sensor in the middle of the scan
  const Pose pose = sample.T_world_sensor.at(scan.start + (scan.end - scan.start) / 2);
  const Quaterniond& q = pose.rotation;
  files.scans.write(fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n",
                                name,
                                scan.sensor,
                                scan.index,
                                seconds(scan.start),
                                seconds(scan.end),
                                scan.beams,
                                scan.points.size(),
                                csv(pose.translation),
                                q.w(),
                                q.x(),
                                q.y(),
                                q.z()));
}

std::string FlightRecorder::partner_name(Label label) const {
  return label_name(label, [this](std::size_t v) { return names_[v]; });
}

void FlightRecorder::write(const CollisionEvent& event) {
  events_.write(fmt::format("{},{},{},{},{},{},{}\n",
                            seconds(event.time),
                            event.entered ? "collision" : "collision_end",
                            names_.at(event.vehicle),
                            partner_name(event.partner),
                            csv(event.vehicle_world),
                            csv(event.position_world),
                            event.penetration));
}

void FlightRecorder::write(const VehicleEvent& event) {
  // no position; mostly no partner and no depth
  events_.write(fmt::format("{},{},{},{},{},,,,{}\n",
                            seconds(event.time),
                            event.kind,
                            names_.at(event.vehicle),
                            event.partner ? partner_name(*event.partner) : "",
                            csv(event.vehicle_world),
                            event.partner ? fmt::format("{}", event.penetration) : ""));
}

void FlightRecorder::write(const ObstacleSample& sample) {
  if (!obstacles_) return;
  for (const auto& [label, pose, shape] : sample.obstacles) {
    const auto* solid = std::get_if<Solid>(&shape);
    obstacles_->write(fmt::format("{},{},{},{},{},{},{},{}\n",
                                  seconds(sample.time),
                                  label,
                                  csv(pose.translation),
                                  pose.rotation.w(),
                                  pose.rotation.x(),
                                  pose.rotation.y(),
                                  pose.rotation.z(),
                                  csv(solid != nullptr ? half_extent(*solid) : Vector3d::Zero())));
  }
}

void FlightRecorder::finish(const Simulation& simulation) {
  if (is_finished_) throw std::logic_error("FlightRecorder: finish() was called before");
  bool is_same = simulation.vehicle_count() == names_.size();
  for (std::size_t v = 0; is_same && v < names_.size(); ++v) {
    is_same = simulation.vehicle(v).setup().name == names_[v];
  }
  require_argument(is_same, "FlightRecorder: finish() with another simulation than its own");
  is_finished_ = true;
  for (const auto& files : vehicles_) {
    if (files) files->commit();
  }
  folder_.drop(kSkippedFile);
  if (obstacles_) obstacles_->commit();
  events_.commit();
  OutputFile summary(path_for("summary.json"));
  summary.write(summary_json(simulation));
  summary.commit();
  folder_.commit();
}

}  // namespace pointflight
