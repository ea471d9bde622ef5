#pragma once

#include <string>

#include "apps/survey_flags.hpp"
#include "pointflight/lidar/return_model.hpp"

namespace pointflight::apps {

/// `lidar fit --map`: what carrying does to a sensor. Its carrier is in its way, and its scans keep
/// some of the motion that deskewing should have taken out.
struct CarriedFlags {
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
void fit_carried_lidar(const CarriedFlags& flags);

}  // namespace pointflight::apps
