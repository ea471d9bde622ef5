#pragma once

#include <CLI/App.hpp>
#include <memory>
#include <optional>
#include <string>

#include "pointflight/core/output_file.hpp"
#include "pointflight/fit/map_fit.hpp"
#include "pointflight/fit/survey_files.hpp"
#include "pointflight/fit/survey_map.hpp"

namespace pointflight::apps {

/// Flags of commands that fit a map to the scans that it was made of.
struct FitFlags {
  SurveyFiles files;
  std::string scan_topic;
  std::string pose_topic;
  std::string sensor_pose;
  std::string ghosts_out;
  double leak_weight = FitOptions{}.leak_weight;
};

/// --scans, --poses, --scan-topic, --pose-topic, --sensor-pose, --free, --deskewed, --leak-weight,
/// --export-ghosts.
void add_fit_flags(CLI::App& app, FitFlags& flags, bool required);

/// The survey of --scans: a folder of clouds, a recording or a folder of MCAP files. Throws
/// InputError.
std::unique_ptr<SurveySource> open_survey(const FitFlags& flags, const Progress& progress);

FitOptions fit_options(const FitFlags& flags);

/// Shares of them, in words.
std::string about_rays(const OwnRays& rays);

/// For the map's metadata.
std::string fit_note(const SurveySource& survey, const FitReport& report);

/// What became of the survey's rays, and of ghosts, on stderr.
void print_fit(const FitReport& report, const OwnRays& after);

/// The file of --export-ghosts, opened before any work is done; nothing where none was asked for.
std::optional<OutputFile> open_ghosts(const FitFlags& flags);

/// Writes the centres of removed surfels as a cloud.
void write_ghosts(std::optional<OutputFile> output, const FitReport& report);

}  // namespace pointflight::apps
