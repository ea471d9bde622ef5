// What commands about made-up worlds have in common.
#pragma once

#include <string>
#include <vector>

#include "apps/cli.hpp"
#include "pointflight/scenes/made_world.hpp"

namespace pointflight::apps {

/// A world's name, `--seed` and `--set`; `chosen` for `read_chosen`.
void add_world_options(CLI::App& app, WorldOptions& options, std::vector<std::string>& chosen);

/// Parameters from `--set`: "aisle=3.2". Throws InputError.
void read_chosen(const std::vector<std::string>& words, WorldOptions& options);

}  // namespace pointflight::apps
