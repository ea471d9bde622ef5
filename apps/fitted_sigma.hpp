#pragma once

#include "pointflight/survey/noise_fit.hpp"

namespace pointflight::apps {

/// A line with a figure and its standard error, in `unit`s of 1 / `scale`, or with what it would
/// have to be to show.
void print_sigma(const char* name, const FittedSigma& fitted, double scale, const char* unit);

}  // namespace pointflight::apps
