#include "apps/survey_flags.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "apps/flags.hpp"
#include "apps/input_kind.hpp"
#include "apps/modules.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/io/pcd_writer.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/recording/mcap_reader.hpp"
#include "pointflight/recording/recorded_survey.hpp"
#include "pointflight/recording/sqlite_reader.hpp"
#include "pointflight/survey/survey_signal.hpp"

namespace pointflight::apps {

namespace fs = std::filesystem;

std::vector<std::string> recordings_in(const std::string& folder) {
  std::vector<std::string> paths;
  std::error_code error;
  for (fs::directory_iterator at(folder, error); !error && at != fs::directory_iterator();
       at.increment(error)) {
    const auto extension = at->path().extension();
    if (extension == ".mcap" || extension == ".db3") paths.push_back(at->path().string());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

std::optional<RecordingOpener> recording_of(const std::string& path) {
  std::error_code ignored;
  std::vector<std::string> paths = {path};
  if (fs::is_directory(path, ignored)) {
    paths = recordings_in(path);
    if (paths.empty()) return std::nullopt;
  }
  if (path.ends_with(".bag")) {
    require_regular_file(path);
    return [path](const std::vector<std::string>& topics) {
      return ros1_module().bag_messages(path, topics);
    };
  }
  const auto all_are = [&](const char* extension) {
    return std::all_of(
        paths.begin(), paths.end(), [&](const std::string& p) { return p.ends_with(extension); });
  };
  if (all_are(".db3")) {
    return [paths](const std::vector<std::string>& topics) {
      return open_sqlite(paths, topics, terminal_progress());
    };
  }
  if (!all_are(".mcap")) {
    throw InputError(fmt::format(
        "{}: is no folder of clouds and no recording (.mcap, .bag, .db3) of one kind", path));
  }
  return [paths](const std::vector<std::string>&) { return open_mcap(paths, terminal_progress()); };
}

std::unique_ptr<ScanSource> open_scans(const std::string& path,
                                       const std::string& topic,
                                       const Progress& progress) {
  if (const auto recording = recording_of(path)) {
    RecordedSurveyOptions options;
    options.name = path;
    options.cloud_topic = topic;
    return std::make_unique<RecordedScans>(*recording, options, progress);
  }
  if (!topic.empty()) throw InputError("--scan-topic is for bags and MCAP files");
  return std::make_unique<ScanFolder>(path, scan_files_in(path));
}

std::unique_ptr<SurveySource> open_survey(const ScansFlags& flags, const Progress& progress) {
  SurveyFiles files = flags.files;
  std::optional<Pose> T_pose_sensor;
  if (!flags.sensor_pose.empty()) T_pose_sensor = parse_pose(flags.sensor_pose, "--sensor-pose");
  require_kind(files.scans,
               {InputKind::kRecording, InputKind::kSqlite, InputKind::kRecordingFolder},
               "a folder of clouds or a recording (.mcap, .bag, .db3)");
  const auto recording = recording_of(files.scans);
  if (!recording) {
    if (files.poses.empty()) throw InputError("--scans: a folder of clouds wants --poses");
    if (!flags.scan_topic.empty() || !flags.pose_topic.empty()) {
      throw InputError("--scan-topic and --pose-topic are for bags and MCAP files");
    }
    files.T_pose_sensor = T_pose_sensor.value_or(Pose{});
    auto folder = std::make_unique<SurveyFolder>(files);
    if (!folder->about_times().empty()) log("warning: " + folder->about_times());
    return folder;
  }
  if (!files.free.empty()) throw InputError("--free: is for folders of scans");
  auto survey = std::make_unique<RecordedSurvey>(*recording,
                                                 RecordedSurveyOptions{files.scans,
                                                                       flags.scan_topic,
                                                                       flags.pose_topic,
                                                                       files.poses,
                                                                       T_pose_sensor,
                                                                       files.is_deskewed,
                                                                       files.time_unit},
                                                 progress);
  end_progress();
  log(survey->about());
  if (!survey->about_times().empty()) log("warning: " + survey->about_times());
  return survey;
}

CLI::Option* add_time_unit_flag(CLI::App& app, std::optional<TimeUnit>& unit) {
  return app
      .add_option_function<std::string>(
          "--time-unit",
          [&unit](const std::string& name) {
            for (const TimeUnit& known : kTimeUnits) {
              if (name == known.name) unit = known;
            }
          },
          "Unit of the points' times: s, ms, us, ns; without it the one in which a scan takes as "
          "long as scans are apart")
      ->check(CLI::IsMember({"s", "ms", "us", "ns"}));
}

CLI::Option* add_scans_flags(CLI::App& app, ScansFlags& flags, bool required) {
  auto* scans = app.add_option("--scans",
                               flags.files.scans,
                               "Folder of the scans, points in the sensor frame; with times of "
                               "their own (field time, t, timestamp) each gets a pose of its own; "
                               "or a recording of them (.bag, .mcap, a folder of .mcap)");
  auto* poses = app.add_option("--poses",
                               flags.files.poses,
                               "Their poses (map <- sensor): TUM (time tx ty tz qx qy qz qw "
                               "[file]) or KITTI (12 numbers); without it those of a recording");
  poses->check(CLI::ExistingFile)->needs(scans);
  scans->check(CLI::ExistingPath);
  if (required) scans->required();
  app.add_option("--scan-topic",
                 flags.scan_topic,
                 "Topic of the clouds in a recording (PointCloud2, CustomMsg); needed only if "
                 "there are several")
      ->needs(scans);
  app.add_option("--pose-topic",
                 flags.pose_topic,
                 "Topic of the poses in a recording (Odometry, PoseStamped); needed only if there "
                 "are several")
      ->excludes(poses)
      ->needs(scans);
  app.add_option(
         "--sensor-pose",
         flags.sensor_pose,
         "Pose of the sensor in the frame of the given poses, x,y,z,roll,pitch,yaw in metres and "
         "degrees; without it a recording's /tf_static is used")
      ->needs(scans);
  auto* deskewed =
      app.add_flag("--deskewed",
                   flags.files.is_deskewed,
                   "Ignore times of points: motion within the scans was compensated already");
  deskewed->needs(scans);
  add_time_unit_flag(app, flags.files.time_unit)->excludes(deskewed)->needs(scans);
  return scans;
}

void add_fit_flags(CLI::App& app, FitFlags& flags, bool required) {
  auto* scans = add_scans_flags(app, flags, required);
  app.add_option(
         "--free",
         flags.files.free,
         "Folder of clouds with the scans' names: shots without a return, as points up to which "
         "the space is free")
      ->check(CLI::ExistingDirectory)
      ->needs(scans);
  app.add_flag("--no-assume",
               flags.no_assume,
               "Leave holes in floors and walls open that no ray went through")
      ->needs(scans);
  app.add_flag("--opacity",
               flags.opacity,
               "Find out which surfels (leaves, nets, panes) let a share of the beams through")
      ->needs(scans);
  app.add_option(
         "--leak-weight",
         flags.leak_weight,
         "How much a ray that passes through a surface of the map counts against one that the "
         "map stops too early; lower values open foliage and gaps more")
      ->check(within(0.1, 100.0))
      ->capture_default_str()
      ->needs(scans);
  auto* signal = app.add_option(
      "--signal-of",
      flags.signal_of,
      "What took the scans, if their intensity is the signal that it received (Ouster's 'signal'): "
      "the map gets reflectivities of it, which decide what comes back");
  signal->needs(scans);
  app.add_option("--signal-limit",
                 flags.signal_limit,
                 "The weakest signal that it reports; without it what 1 % of the returns do not "
                 "reach")
      ->check(within(1e-6, 1e9))
      ->needs(signal);
  app.add_option("--export-ghosts",
                 flags.ghosts_out,
                 "Write the positions of removed moving objects as a PCD cloud")
      ->needs(scans);
}

std::string about_rays(const OwnRays& rays) {
  const auto share = [](std::uint64_t part, std::uint64_t all) {
    return 100.0 * static_cast<double>(part) / static_cast<double>(std::max<std::uint64_t>(1, all));
  };
  std::string text = fmt::format("{:.1f} % right, {:.1f} % early, {:.1f} % late or none",
                                 share(rays.right, rays.returns),
                                 share(rays.early, rays.returns),
                                 share(rays.leaks, rays.returns));
  if (rays.empty > 0) {
    text += fmt::format("; {:.1f} % of the empty ones stopped", share(rays.stopped, rays.empty));
  }
  return text;
}

FitOptions fit_options(const FitFlags& flags) {
  FitOptions options;
  options.opacity = flags.opacity;
  options.leak_weight = flags.leak_weight;
  return options;
}

std::optional<ClosingOptions> closing_options(const FitFlags& flags) {
  if (flags.no_assume) return std::nullopt;
  return ClosingOptions{};
}

void print_closed(const FitFlags& flags, const ClosingReport& report) {
  if (flags.no_assume) return;
  log(fmt::format(
      "holes         {} surfels assumed in {} large planes; {} cells were passed by rays, {} lie "
      "beside openings",
      short_count(static_cast<double>(report.assumed)),
      report.planes,
      short_count(static_cast<double>(report.passed)),
      short_count(static_cast<double>(report.opening))));
}

std::string fit_note(const SurveySource& survey, const FitReport& report) {
  return fmt::format("fit to {} rays of {} scans", report.rays, survey.scan_count());
}

void print_fit(const FitReport& report, const OwnRays& after) {
  log(fmt::format("survey rays   {}, {} without a return",
                  short_count(static_cast<double>(report.rays)),
                  short_count(static_cast<double>(report.before.empty))));
  log("  before      " + about_rays(report.before));
  log("  fitted      " + about_rays(after));
  if (report.overflows > 0) {
    log(fmt::format("  crowded     {} rays were ended early: they hit too many surfels",
                    report.overflows));
  }
  log(fmt::format("ghosts        {} surfels of what moved removed, {} that only stood in the way",
                  report.ghosts.size(),
                  report.blamed));
  if (report.clear > 0) {
    log(fmt::format("opacity       {} surfels let beams through", report.clear));
  }
}

void check_signal(const FitFlags& flags, const SurveySource& survey) {
  if (flags.signal_of.empty()) return;
  if (load_lidar(flags.signal_of).detection.rated.empty()) {
    throw InputError(fmt::format(
        "--signal-of {}: its file states no rated ranges (detection.rated): signals mean nothing",
        flags.signal_of));
  }
  const auto reader = survey.open();
  std::vector<SurveyRay> batch;
  bool has_signal = false;
  while (!has_signal && reader->read(batch)) {
    has_signal = std::any_of(
        batch.begin(), batch.end(), [](const SurveyRay& ray) { return ray.intensity > 0.0f; });
  }
  if (!has_signal) {
    throw InputError(
        fmt::format("--signal-of {}: the scans carry no intensities", flags.signal_of));
  }
}

void paint_by_signal(EditedMap& map,
                     const FitFlags& flags,
                     const SurveySource& survey,
                     const EditOptions& options,
                     const Executor& executor,
                     const Progress& progress) {
  if (flags.signal_of.empty()) return;
  SignalOptions signal;
  signal.detection = load_lidar(flags.signal_of).detection;
  if (flags.signal_limit > 0.0) signal.limit = flags.signal_limit;
  SignalReport report;
  paint_reflectivity(
      map, [&] { return survey.open(); }, signal, options, executor, report, progress);
  end_progress();
  log(fmt::format(
      "reflectivity  {:.2g} to {:.2g}, half of the surfels above {:.2g}; the weakest signal is "
      "{:.3g}{}",
      report.reflectivities[0],
      report.reflectivities[2],
      report.reflectivities[1],
      report.limit,
      report.unseen > 0 ? fmt::format(", {} surfels that no return hit are dark",
                                      short_count(static_cast<double>(report.unseen)))
                        : ""));
}

std::vector<std::string> survey_inputs(const ScansFlags& flags) {
  return {flags.files.scans, flags.files.poses, flags.files.free};
}

std::optional<OutputFile> open_ghosts(const FitFlags& flags) {
  if (flags.ghosts_out.empty()) return std::nullopt;
  return OutputFile(flags.ghosts_out);
}

void write_ghosts(std::optional<OutputFile> output, const FitReport& report) {
  if (!output) return;
  std::vector<CloudPoint> points;
  for (const Vector3d& center : report.ghosts) points.push_back({center, 0.0f});
  write_cloud_pcd(std::move(*output), points, false);
}

}  // namespace pointflight::apps
