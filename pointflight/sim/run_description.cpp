#include "pointflight/sim/run_description.hpp"

#include "pointflight/sim/simulation.hpp"

namespace pointflight {

RunDescription describe_run(const Simulation& simulation) {
  RunDescription run;
  run.scenario = scenario_yaml(simulation.scenario());
  run.seed = simulation.scenario().seed;
  run.map = simulation.shared_map();
  for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
    const VehicleAgent& agent = simulation.vehicle(v);
    VehicleDescription& vehicle = run.vehicles.emplace_back();
    vehicle.setup = agent.setup();
    vehicle.settings = agent.settings();
    vehicle.hull = agent.hull();
    vehicle.shape = agent.shape();
    vehicle.look = agent.look();
    for (const MountedLidar* mounted : agent.lidars()) {
      vehicle.lidars.push_back({mounted->lidar().settings(), mounted->T_body_sensor()});
    }
    for (const MountedSensor& sensor : agent.sensors()) {
      vehicle.sensors.push_back(sensor.kind != nullptr ? sensor.kind->name : "");
    }
    vehicle.at_start = simulation.status_sample(v);
    vehicle.own = simulation.flies_here(v);
  }
  return run;
}

}  // namespace pointflight
