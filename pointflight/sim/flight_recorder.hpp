#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/output_file.hpp"
#include "pointflight/sim/run_folder.hpp"
#include "pointflight/sim/simulation.hpp"

namespace pointflight {

/// Writes a run into a folder. For each vehicle, in the folder itself if there is only one and
/// in one of its name else: trajectory.csv, trajectory.tum, imu.csv, odometry.csv, `<kind>.csv` of
/// own sensors, scans.csv and `scans/<lidar>_<number>.pcd`. For all: scenario.yaml with what it
/// needs (scenario_copy.hpp), events.csv, obstacles.csv and at last summary.json. Files appear when
/// `finish` is called, all together; without it none do, and an earlier run stays (run_folder.hpp).
/// Throws InputError (disk full, not writable), std::logic_error once it is finished, and
/// std::invalid_argument for samples of a vehicle that the run does not have.
class FlightRecorder : public SampleSink {
 public:
  /// Makes the folders; they must be writable.
  FlightRecorder(const std::string& folder,
                 const Simulation& simulation,
                 Existing existing = Existing::kRefuse);
  ~FlightRecorder() override;

  void on_sample(const Sample& sample) override;

  /// Where to write a file that shall be part of the run, before `finish`. Throws InputError if the
  /// folder has a file of that name that no run wrote.
  [[nodiscard]] std::string path_for(const std::string& name);

  /// Closes the files and writes summary.json. Throws std::invalid_argument if it is not the run
  /// that the recorder was made for.
  void finish(const Simulation& simulation);

 private:
  struct VehicleFiles;
  void add_sensor_files(const VehicleAgent& vehicle, VehicleFiles& files);
  void write(const StateSample& sample);
  void write(const OdometrySample& sample);
  void write(const ImuSample& sample);
  void write(const Measurement& sample);
  void write(const ScanSample& sample);
  void write(const CollisionEvent& event);
  void write(const VehicleEvent& event);
  void write(const ObstacleSample& sample);
  void write(const StatusSample& /*sample*/) {}
  [[nodiscard]] std::string partner_name(Label label) const;
  void keep_up(VehicleFiles& files, const StateSample& sample);
  [[nodiscard]] VehicleFiles& files_of(std::uint32_t vehicle) const;

  RunFolder folder_;
  bool is_finished_ = false;
  bool write_scans_;
  /// Of a run that other processes share: a process that is killed goes on where its trajectories
  /// end.
  bool is_shared_;
  Duration skipped_{-1};                                 ///< As the file beside them has it.
  std::vector<std::string> names_;                       ///< Of the vehicles.
  std::vector<std::unique_ptr<VehicleFiles>> vehicles_;  ///< Null: another process' vehicle.
  OutputFile events_;
  std::optional<OutputFile> obstacles_;
};

/// "map", "drone1", "obstacle 3": what a label stands for in a run.
std::string label_name(const Simulation& simulation, Label label);

/// Names of the files of sensors that a program has added, by `Measurement::sensor`:
/// "barometer.csv", "barometer_1.csv", ...
std::map<std::size_t, std::string> sensor_files(const VehicleAgent& vehicle);

}  // namespace pointflight
