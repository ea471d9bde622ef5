// A map as a command line names it: a file, or a made-up world.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "pointflight/sim/scenario.hpp"

namespace pointflight::apps {

/// The world that "street" or "street:7" names; nothing if there is a file of that name, or no such
/// kind of world.
std::optional<WorldMapOptions> world_in(const std::string& name);

/// The map that a scenario names, with progress if it is a world's. Throws InputError.
std::shared_ptr<const SurfelMap> open_map_of(const Scenario& scenario);

/// Opens a .pfmap, or makes the map of a world, which takes seconds. Throws InputError.
std::shared_ptr<const SurfelMap> open_named_map(const std::string& name);

}  // namespace pointflight::apps
