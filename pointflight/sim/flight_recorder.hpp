#pragma once

#include <optional>
#include <string>

#include "pointflight/core/output_file.hpp"
#include "pointflight/sim/simulation.hpp"

namespace pointflight {

/// Writes a run into a folder: trajectory.csv, trajectory.tum, imu.csv, events.csv, scans.csv and
/// scans/<lidar>_<number>.pcd, and at last summary.json. Files appear under their names when
/// `finish` is called; scans as they are taken. Throws InputError (disk full, not writable).
class FlightRecorder : public SampleSink {
 public:
  /// Makes the folder; it must be writable.
  FlightRecorder(const std::string& folder, const Scenario& scenario, std::size_t rotors);

  void on_state(const StateSample& sample) override;
  void on_imu(const ImuSample& sample) override;
  void on_scan(const Scan& scan, const PoseAt& pose_at) override;
  void on_collision(const CollisionEvent& event) override;

  /// Closes the files and writes summary.json.
  void finish(const Simulation& simulation);

 private:
  std::string folder_;
  bool write_scans_;
  std::optional<OutputFile> imu_;
  OutputFile trajectory_;
  OutputFile tum_;
  OutputFile events_;
  OutputFile scans_;
};

/// summary.json as text: what happened, without wall-clock figures.
std::string summary_json(const Simulation& simulation);

}  // namespace pointflight
