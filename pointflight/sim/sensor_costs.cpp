#include "pointflight/sim/sensor_costs.hpp"

#include <algorithm>
#include <map>

#include "pointflight/sim/simulation.hpp"

namespace pointflight {

SensorCosts::SensorCosts(const Fleet& fleet) {
  for (std::size_t v = 0; v < fleet.size(); ++v) {
    vehicles_.push_back(std::make_unique<Accounts[]>(fleet.vehicle(v).sensors().size()));
  }
}

std::vector<LidarCost> lidar_costs(const Simulation& simulation) {
  std::map<std::string, LidarCost> by_model;
  for (const std::size_t v : simulation.flying_here()) {
    const VehicleAgent& vehicle = simulation.vehicle(v);
    // LiDARs are the last of its sensors
    const std::size_t first = vehicle.sensors().size() - vehicle.lidars().size();
    for (std::size_t i = 0; i < vehicle.lidars().size(); ++i) {
      const std::string& model = vehicle.setup().lidars[i].model;
      LidarCost& cost =
          by_model.try_emplace(model, LidarCost{model, 0, 0.0, 0.0, v, i}).first->second;
      ++cost.count;
      const SensorCosts::Accounts& accounts = simulation.costs().of(v, first + i);
      cost.rendering += accounts.rendering.seconds();
      cost.cpu_time += accounts.rendering.seconds() + accounts.rest.seconds();
    }
  }
  std::vector<LidarCost> costs;
  costs.reserve(by_model.size());
  for (auto& [model, cost] : by_model) costs.push_back(std::move(cost));
  std::stable_sort(costs.begin(), costs.end(), [](const LidarCost& a, const LidarCost& b) {
    return a.cpu_time > b.cpu_time;
  });
  return costs;
}

ScanCost measure_scan(const Simulation& simulation, std::size_t vehicle, std::size_t lidar) {
  const MountedLidar& mounted = *simulation.vehicle(vehicle).lidars().at(lidar);
  const Executor alone(1);
  const PoseTrack track = PoseTrack(simulation.status(vehicle).state.body.T_world_body())
                              .with_mount(mounted.T_body_sensor());
  const auto cost_of = [&](const Lidar& measured) {
    ScanRequest request;
    request.start = simulation.time();
    request.snapshot = mounted.takes_snapshots();
    CpuAccount account;
    {
      const ChargeTo charge(&account);
      (void)measured.take(request, track, *mounted.renderer(), alone);
    }
    return account.seconds();
  };
  return {cost_of(mounted.lidar()), cost_of(mounted.lidar().as_lines())};
}

}  // namespace pointflight
