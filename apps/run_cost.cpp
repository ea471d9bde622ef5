#include "apps/run_cost.hpp"

#include <nlohmann/json.hpp>

namespace pointflight::apps {

RunCost cost_of(const Simulation& simulation, const RunLoop& loop) {
  const double simulated = loop.simulated();
  const double per_second = simulated > 0.0 ? 1.0 / simulated : 0.0;
  RunCost cost;
  cost.real_time_factor = simulated / loop.wall_time();
  cost.cores = loop.cpu_time() * per_second;
  for (const LidarCost& lidar : lidar_costs(simulation)) {
    cost.lidars.push_back(
        {lidar.model, lidar.count, lidar.cpu_time * per_second, lidar.rendering * per_second});
  }
  return cost;
}

nlohmann::ordered_json json_of(const RunCost& cost) {
  nlohmann::ordered_json json;
  json["cores"] = cost.cores;
  auto& lidars = json["lidars"] = nlohmann::ordered_json::array();
  for (const RunCost::Lidar& lidar : cost.lidars) {
    lidars.push_back({{"model", lidar.model},
                      {"count", lidar.count},
                      {"cores", lidar.cores},
                      {"rendering", lidar.rendering}});
  }
  return json;
}

}  // namespace pointflight::apps
