#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight::apps {

/// Check of a flag: a number within limits. (CLI::Range lets NaN pass.)
CLI::Validator within(double min, double max);

/// --start-in: a box in the world, m. `box_from` throws InputError where it is none.
void add_start_in_flag(CLI::App& app, std::vector<double>& numbers);
Aabb box_from(const std::vector<double>& numbers, const std::string& flag);

/// Throws InputError where both names mean one file.
void refuse_same_file(const std::string& output, const std::string& input);

}  // namespace pointflight::apps
