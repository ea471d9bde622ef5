#pragma once

#include <CLI/App.hpp>
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
  std::string ghosts_out;
  double leak_weight = FitOptions{}.leak_weight;
};

/// --scans, --poses, --free, --deskewed, --leak-weight, --export-ghosts.
void add_fit_flags(CLI::App& app, FitFlags& flags, bool required);

FitOptions fit_options(const FitFlags& flags);

/// Shares of them, in words.
std::string about_rays(const OwnRays& rays);

/// For the map's metadata.
std::string fit_note(const SurveyFolder& survey, const FitReport& report);

/// What became of the survey's rays, and of ghosts, on stderr.
void print_fit(const FitReport& report, const OwnRays& after);

/// The file of --export-ghosts, opened before any work is done; nothing where none was asked for.
std::optional<OutputFile> open_ghosts(const FitFlags& flags);

/// Writes the centres of removed surfels as a cloud.
void write_ghosts(std::optional<OutputFile> output, const FitReport& report);

}  // namespace pointflight::apps
