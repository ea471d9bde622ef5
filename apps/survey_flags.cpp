#include "apps/survey_flags.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "apps/flags.hpp"
#include "apps/terminal.hpp"
#include "pointflight/io/pcd_writer.hpp"

namespace pointflight::apps {
void add_fit_flags(CLI::App& app, FitFlags& flags, bool required) {
  auto* scans = app.add_option("--scans",
                               flags.files.scans,
                               "Folder of the scans, points in the sensor frame; with times of "
                               "their own (field time, t, timestamp) each gets a pose of its own");
  auto* poses = app.add_option("--poses",
                               flags.files.poses,
                               "Their poses (map <- sensor): TUM (time tx ty tz qx qy qz qw "
                               "[file]) or KITTI (12 numbers)");
  poses->check(CLI::ExistingFile)->needs(scans);
  scans->check(CLI::ExistingDirectory)->needs(poses);
  if (required) {
    scans->required();
    poses->required();
  }
  app.add_option("--free",
                 flags.files.free,
                 "Folder of clouds under the scans' names: shots without a return, up to where "
                 "all was free")
      ->check(CLI::ExistingDirectory)
      ->needs(scans);
  app.add_flag("--deskewed",
               flags.files.is_deskewed,
               "Motion within the scans was taken out: times of points are left aside")
      ->needs(scans);
  app.add_option("--leak-weight",
                 flags.leak_weight,
                 "A ray that the map lets through weighs as many that it stops early; lower makes "
                 "openings and foliage opener")
      ->check(within(0.1, 100.0))
      ->capture_default_str()
      ->needs(scans);
  app.add_option("--export-ghosts",
                 flags.ghosts_out,
                 "Write where what moved through the survey was taken out, as a PCD cloud")
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
  options.leak_weight = flags.leak_weight;
  return options;
}

std::string fit_note(const SurveyFolder& survey, const FitReport& report) {
  return fmt::format("fit to {} rays of {} scans", report.rays, survey.scan_count());
}

void print_fit(const FitReport& report, const OwnRays& after) {
  log(fmt::format("survey rays   {}, {} without a return",
                  short_count(static_cast<double>(report.rays)),
                  short_count(static_cast<double>(report.before.empty))));
  log("  before      " + about_rays(report.before));
  log("  fitted      " + about_rays(after));
  if (report.overflows > 0) {
    log(fmt::format("  crowded     {} rays were ended early: they met too many surfels",
                    report.overflows));
  }
  log(fmt::format("ghosts        {} surfels of what moved removed, {} that only stood in the way",
                  report.ghosts.size(),
                  report.blamed));
}

std::optional<OutputFile> open_ghosts(const FitFlags& flags) {
  if (flags.ghosts_out.empty()) return std::nullopt;
  refuse_same_file(flags.ghosts_out, flags.files.poses);
  return OutputFile(flags.ghosts_out);
}

void write_ghosts(std::optional<OutputFile> output, const FitReport& report) {
  if (!output) return;
  std::vector<CloudPoint> points;
  for (const Vector3d& center : report.ghosts) points.push_back({center, 0.0f});
  write_cloud_pcd(std::move(*output), points, false);
}

}  // namespace pointflight::apps
