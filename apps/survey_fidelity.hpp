#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/cli.hpp"
#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/fidelity/survey_walk.hpp"
#include "pointflight/scenes/exact_scene.hpp"

namespace pointflight::apps {

/// Flags of `fidelity --survey`.
struct SurveyFlags {
  bool on = false;
  SurveyOptions walk;
  double thin = 0.05;  ///< m; 0: all points.
  bool fit = false;
  bool opacity = false;  ///< Of fitted maps.
  std::string out;       ///< Folder for the survey itself.
  // shared with the other kind of `fidelity`; nothing: not given
  std::string lidar = "mid360";
  std::vector<std::optional<double>> resolutions;
  std::vector<std::string> renderers;
  std::optional<float> tau;
  std::size_t places = 12;
  bool json = false;
};

/// --survey, --seconds, --shake, --tilt, --thin, --fit, --opacity, --survey-out.
void add_survey_flags(CLI::App& app, SurveyFlags& flags);

/// Walks a LiDAR through the scene, maps what it saw and judges the map by an OS1-32 at positions
/// beside the walk. Prints tables, or appends to `cases`. Throws InputError.
void measure_surveyed(const ExactScene& scene,
                      const SurveyFlags& flags,
                      const Executor& executor,
                      const Progress& progress,
                      nlohmann::ordered_json& cases);

}  // namespace pointflight::apps
