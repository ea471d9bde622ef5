#pragma once

#include <vector>

#include "apps/cli.hpp"
#include "pointflight/lidar/return_model.hpp"

namespace pointflight::apps {

/// --sun, --reflectivity, --reflectivity-per-intensity, and one of --fog, --dust, --rain, --snow.
std::vector<CLI::Option*> add_surroundings_flags(CLI::App& app, Surroundings& surroundings);

}  // namespace pointflight::apps
