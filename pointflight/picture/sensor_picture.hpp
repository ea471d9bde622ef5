#pragma once

#include <string>

#include "pointflight/fidelity/blockage_fit.hpp"
#include "pointflight/fidelity/sensor_comparison.hpp"
#include "pointflight/survey/sensor_fit.hpp"

namespace pointflight::picture {

/// Shares of returns over range, and errors at edges: real, by the sensor's model, without it.
/// Throws InputError if it cannot be written.
void draw_sensor_comparison(const SensorComparison& comparison,
                            const std::string& title,
                            const std::string& path);

/// Noise by range and incidence, and what the fitted figures give. Throws InputError if it cannot
/// be written.
void draw_sensor_fit(const SensorFit& fit, const std::string& title, const std::string& path);

/// In which directions a sensor is blocked by what carries it. Throws InputError if it cannot be
/// written.
void draw_blockage(const BlockageFit& fit, const std::string& title, const std::string& path);

}  // namespace pointflight::picture
