#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pointflight/core/cpu_account.hpp"
#include "pointflight/sim/fleet.hpp"

namespace pointflight {

class Simulation;

/// What the sensors of a fleet that measure for a while have cost so far. It is no part of a run's
/// results.
class SensorCosts {
 public:
  /// Of one sensor. Any thread may charge it.
  struct Accounts {
    CpuAccount rendering;  ///< What its renderer took.
    CpuAccount rest;       ///< All else: where beams go, what comes back, points.
  };

  /// Of all its vehicles' sensors; nothing yet.
  explicit SensorCosts(const Fleet& fleet);

  /// By the sensor's number on its vehicle (`VehicleAgent::sensors`).
  [[nodiscard]] Accounts& of(std::size_t vehicle, std::size_t sensor) const {
    return vehicles_[vehicle][sensor];
  }

 private:
  std::vector<std::unique_ptr<Accounts[]>> vehicles_;
};

/// LiDARs of one model together.
struct LidarCost {
  std::string model;        ///< As the scenario says it.
  std::size_t count = 0;    ///< LiDARs.
  double cpu_time = 0.0;    ///< s
  double rendering = 0.0;   ///< The renderer's part of it, s.
  std::size_t vehicle = 0;  ///< Of one of them: its vehicle,
  std::size_t lidar = 0;    ///< and its number among the vehicle's LiDARs.
};

/// What the LiDARs of vehicles that fly here have cost, the dearest model first.
[[nodiscard]] std::vector<LidarCost> lidar_costs(const Simulation& simulation);

/// CPU time of one scan.
struct ScanCost {
  double as_is = 0.0;     ///< s
  double as_lines = 0.0;  ///< With beams that are lines, s.
};

/// Takes two scans of a LiDAR from where its vehicle is now. Bodies are left out.
[[nodiscard]] ScanCost measure_scan(const Simulation& simulation,
                                    std::size_t vehicle,
                                    std::size_t lidar);

}  // namespace pointflight
