#pragma once

#include <string>

#include "apps/survey_flags.hpp"
#include "pointflight/lidar/return_model.hpp"

namespace pointflight::apps {

/// `lidar fit --map`: what carries a sensor and is in its way.
struct BlockageFlags {
  ScansFlags posed;           ///< Scans with poses.
  std::string map;            ///< Of what they saw.
  std::string like;           ///< The sensor.
  Surroundings surroundings;  ///< Of the scans.
  std::string output;         ///< Sensor file.
  std::string png;            ///< Picture.
  bool json = false;          ///< On stdout.
  bool force = false;         ///< Files may be there.
  int threads = 0;            ///< 0: all cores.
};

/// Finds and writes it. Throws InputError.
void fit_blockage_of(const BlockageFlags& flags);

}  // namespace pointflight::apps
