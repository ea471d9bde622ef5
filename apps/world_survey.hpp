// Maps of made-up worlds as a survey gives them.
#pragma once

#include <optional>
#include <string>

#include "apps/cli.hpp"
#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/map/edit/map_edit.hpp"
#include "pointflight/scenes/made_world.hpp"

namespace pointflight::apps {

/// Flags of `world make` for surveys.
struct WorldSurveyFlags {
  bool on = false;
  std::string lidar = "mid360";
  double length = 150.0;  ///< Of the walk, about, m.
  double speed = 1.0;     ///< m/s
  double drift = 0.02;    ///< m
  std::string scans;      ///< Folder for the scans; empty: they are not kept.
};

/// --survey, --lidar, --walk, --speed, --drift, --scans.
void add_world_survey_flags(CLI::App& app, WorldSurveyFlags& flags);

/// Carries a LiDAR through the world, and makes the map of what it saw as `map import --scans`
/// does: at a resolution (m) or, without, at the one that suits it best. Writes the scans if they
/// are wanted. Throws InputError.
EditedMap survey_world(const WorldOptions& options,
                       const WorldSurveyFlags& flags,
                       std::optional<double> resolution,
                       const Executor& executor,
                       const Progress& progress);

}  // namespace pointflight::apps
