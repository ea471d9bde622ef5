#pragma once

#include <CLI/App.hpp>
#include <string>

namespace pointflight::apps {

/// Check of a flag: a number within limits. (CLI::Range lets NaN pass.)
CLI::Validator within(double min, double max);

/// Throws InputError where both names mean one file.
void refuse_same_file(const std::string& output, const std::string& input);

}  // namespace pointflight::apps
