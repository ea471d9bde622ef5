// What a run is, said once at its start: whoever has it can show, publish and store the run's
// samples without the simulation.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "pointflight/geometry/assembly.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/map/body.hpp"
#include "pointflight/sim/samples.hpp"
#include "pointflight/sim/scenario.hpp"

namespace pointflight {

class Simulation;

/// A LiDAR on a vehicle.
struct LidarDescription {
  LidarSettings settings;  ///< Of its sensor file.
  Pose T_body_sensor;      ///< Where it is mounted.
};

/// What does not change of a vehicle.
struct VehicleDescription {
  VehicleSetup setup;                    ///< As the scenario has it, with a name.
  VehicleSettings settings;              ///< The vehicle file's, with the scenario's limits.
  Solid hull;                            ///< What must not touch anything, body frame.
  BodyShape shape;                       ///< The hull.
  std::shared_ptr<const Assembly> look;  ///< What LiDARs see of it; null: the hull.
  std::vector<LidarDescription> lidars;  ///< In the order of the scenario.
  /// Kinds by `Measurement::sensor`; empty for odometry, IMU and LiDARs.
  std::vector<std::string> sensors;
  StatusSample at_start;  ///< Before the first step.
  bool own = true;        ///< False: it is flown elsewhere; there are no samples of it.
};

/// A run. Topics and frames follow from names, models and the profile.
struct RunDescription {
  std::string scenario;                      ///< As a file's text.
  std::int64_t seed = 0;                     ///< Of everything random.
  std::shared_ptr<const SurfelMap> map;      ///< Never null; says its path and hash.
  std::vector<VehicleDescription> vehicles;  ///< By number.
};

/// Of a simulation as it stands.
RunDescription describe_run(const Simulation& simulation);

}  // namespace pointflight
