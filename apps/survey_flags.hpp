#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/cli.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/recording/recorded_survey.hpp"
#include "pointflight/survey/map_fit.hpp"
#include "pointflight/survey/posed_scans.hpp"
#include "pointflight/survey/survey_map.hpp"

namespace pointflight::apps {

/// Flags of commands that read scans with poses.
struct ScansFlags {
  SurveyFiles files;
  std::string scan_topic;
  std::string pose_topic;
  std::string sensor_pose;
};

/// --time-unit.
CLI::Option* add_time_unit_flag(CLI::App& app, std::optional<TimeUnit>& unit);

/// --scans, --poses, --scan-topic, --pose-topic, --sensor-pose, --deskewed. Returns --scans.
CLI::Option* add_scans_flags(CLI::App& app, ScansFlags& flags, bool required);

/// Flags of commands that fit a map to the scans that it was made of.
struct FitFlags : ScansFlags {
  std::string ghosts_out;
  double leak_weight = FitOptions{}.leak_weight;
  std::string signal_of;
  double signal_limit = 0.0;  ///< 0: found.
  bool no_assume = false;
  bool opacity = false;
};

/// Those of a survey, --free, --no-assume, --leak-weight, --export-ghosts, --signal-of,
/// --signal-limit.
void add_fit_flags(CLI::App& app, FitFlags& flags, bool required);

/// The MCAP files of a folder, in the order of their names. Throws InputError if it holds a
/// recording in SQLite.
std::vector<std::string> recordings_in(const std::string& folder);

/// How to open a recording: a .bag, a .mcap, a folder of .mcap; nothing if `path` is a folder
/// without any. Throws InputError if it is neither a folder nor a recording.
std::optional<RecordingOpener> recording_of(const std::string& path);

/// The scans of a folder of clouds or a recording, without poses. Throws InputError.
std::unique_ptr<ScanSource> open_scans(const std::string& path,
                                       const std::string& topic,
                                       const Progress& progress);

/// Files and folders that these flags read.
std::vector<std::string> survey_inputs(const ScansFlags& flags);

/// The survey of --scans: a folder of clouds, a recording or a folder of MCAP files. Throws
/// InputError.
std::unique_ptr<SurveySource> open_survey(const ScansFlags& flags, const Progress& progress);

FitOptions fit_options(const FitFlags& flags);

/// Nothing with --no-assume.
std::optional<ClosingOptions> closing_options(const FitFlags& flags);

/// What was assumed in holes of floors and walls, on stderr.
void print_closed(const FitFlags& flags, const ClosingReport& report);

/// Shares of them, in words.
std::string about_rays(const OwnRays& rays);

/// For the map's metadata.
std::string fit_note(const SurveySource& survey, const FitReport& report);

/// What became of the survey's rays, and of ghosts, on stderr.
void print_fit(const FitReport& report, const OwnRays& after);

/// Refuses a --signal-of that cannot be done, before a fit has taken its time. Throws InputError.
void check_signal(const FitFlags& flags, const SurveySource& survey);

/// Does what --signal-of asks for, and says on stderr what came of it.
void paint_by_signal(EditedMap& map,
                     const FitFlags& flags,
                     const SurveySource& survey,
                     const EditOptions& options,
                     const Executor& executor,
                     const Progress& progress);

/// The file of --export-ghosts, opened before any work is done; nothing if none was asked for.
std::optional<OutputFile> open_ghosts(const FitFlags& flags);

/// Writes the centres of removed surfels as a cloud.
void write_ghosts(std::optional<OutputFile> output, const FitReport& report);

}  // namespace pointflight::apps
