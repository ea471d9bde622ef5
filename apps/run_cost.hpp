#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "pointflight/run/run_loop.hpp"
#include "pointflight/sim/sensor_costs.hpp"

namespace pointflight::apps {

/// What a run took of this machine: no part of its results.
struct RunCost {
  /// LiDARs of one model.
  struct Lidar {
    std::string model;
    std::size_t count = 0;
    double cores = 0.0;      ///< CPU time of all, per simulated second.
    double rendering = 0.0;  ///< The renderer's part of it.
  };
  double real_time_factor = 0.0;
  double cores = 0.0;         ///< CPU time of the process per simulated second.
  std::vector<Lidar> lidars;  ///< The dearest first.
};

/// Of a run that has come to its end.
[[nodiscard]] RunCost cost_of(const Simulation& simulation, const RunLoop& loop);

/// As users find it in timing.json and behind `fly --json`.
[[nodiscard]] nlohmann::ordered_json json_of(const RunCost& cost);

}  // namespace pointflight::apps
