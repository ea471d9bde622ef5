#include "apps/import_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "apps/terminal.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight::apps {

std::string about_spacing(double spacing, double resolution, double supported) {
  if (spacing <= 0.0) return "unknown";
  const std::string points = fmt::format("{:.1f} mm", spacing * 1e3);
  if (resolution >= 0.9 * supported) return points;
  return fmt::format("{}: {:.4g} m is finer than the points, {:.2g} m or more is advised",
                     points,
                     resolution,
                     supported);
}

void print_tried(const std::vector<TriedResolution>& tried, std::string_view judged_by) {
  for (const TriedResolution& one : tried) {
    log(fmt::format(
        "  {:.4g} m     {:.2f} % right of {}", one.resolution, 100.0 * one.right, judged_by));
  }
}

std::string about_noise(double noise, std::uint64_t projected, std::uint64_t too_thick) {
  return fmt::format(
      "{:.1f} mm across flat surfaces; {}",
      noise * 1e3,
      projected > 0
          ? fmt::format(
                "removed from {} cells; {} skipped (two parallel surfaces?)", projected, too_thick)
          : "too little to remove");
}

namespace {

/// "intensity from 'Reflectance'; left out: ring, time", and whatever else its reader noted.
std::vector<std::string> about_columns(const FileColumns& columns) {
  std::vector<std::string> lines = columns.notes;
  std::vector<std::string> left_out = columns.of_scans;
  left_out.insert(left_out.end(), columns.left_out.begin(), columns.left_out.end());
  std::string line;
  if (!columns.intensity.empty() && columns.intensity != "intensity") {
    line = fmt::format("intensity from '{}'", excerpt(columns.intensity));
  }
  if (!left_out.empty()) {
    constexpr std::size_t kMost = 12;
    const std::size_t more = left_out.size() - std::min(left_out.size(), kMost);
    left_out.resize(left_out.size() - more);
    for (std::string& name : left_out) name = excerpt(name);
    line += fmt::format("{}left out: {}{}",
                        line.empty() ? "" : "; ",
                        fmt::join(left_out, ", "),
                        more > 0 ? fmt::format(" and {} more", more) : "");
  }
  if (!line.empty()) lines.push_back(line);
  return lines;
}

/// Files that say the same have one line.
void print_columns(const ImportReport& report) {
  std::map<std::string, std::vector<std::string>> sources;
  for (const SourceColumns& source : report.columns) {
    for (const std::string& line : about_columns(source.columns)) {
      sources[line].push_back(source.source);
    }
  }
  for (const auto& [line, names] : sources) {
    log(fmt::format("columns       {}{}: {}",
                    names.front(),
                    names.size() > 1 ? fmt::format(" and {} more", names.size() - 1) : "",
                    line));
  }
}

}  // namespace

void print_report(const ImportReport& r, const ImportOptions& options) {
  log(fmt::format(
      "points        {} read{}{}",
      short_count(static_cast<double>(r.points_read)),
      r.points_not_finite > 0 ? fmt::format(", {} NaN or infinite dropped", r.points_not_finite)
                              : "",
      r.points_out_of_reach > 0 ? fmt::format(", {} too far away dropped", r.points_out_of_reach)
                                : ""));
  log(fmt::format("size          {:.4g} x {:.4g} x {:.4g} m", r.size.x(), r.size.y(), r.size.z()));
  log(fmt::format("resolution    {:.4g} m{}",
                  r.resolution,
                  r.resolution_was_tried    ? " (the best by those tried)"
                  : r.resolution_was_chosen ? " (chosen from the spacing)"
                                            : ""));
  // what was tried needs no advice
  const double advised = r.resolution_was_tried ? 0.0 : r.supported_resolution;
  log("spacing       " + about_spacing(r.spacing, r.resolution, advised));
  print_columns(r);
  if (r.intensity_outliers_from > 0.0) {
    log(fmt::format("intensity     99.9 % are below {:.4g}; brighter ones are kept in coarse steps",
                    r.intensity_outliers_from));
  }
  if (r.intensity_from_colors) log("colours       kept as intensities: their luminance, 0 to 255");
  log(fmt::format("outliers      {}",
                  options.outliers.enabled
                      ? fmt::format("{} of {} cells ({} points) dropped; --keep-outliers keeps "
                                    "them, --export-outliers FILE.pcd shows them",
                                    r.outlier_cells,
                                    r.cells,
                                    r.outlier_points)
                      : "kept"));
  log("noise         " + about_noise(r.noise, r.projection.projected, r.projection.too_thick));
  if (r.grown_surfels + r.wide_surfels > 0) {
    log(fmt::format("thin scan     {} surfels widened to close gaps, {} cover several cells each",
                    r.grown_surfels,
                    r.wide_surfels));
  }
  if (r.merged_surfels > 0) {
    log(fmt::format("planes        {} surfels that cover several cells each", r.merged_surfels));
  }
  if (r.small_surfels > 0) {
    log(fmt::format("detail        {} surfels smaller than a cell", r.small_surfels));
  }
  log(fmt::format("hit threshold {:.2f} of a beam covered ({:.0f} points per planar surfel)",
                  r.tau,
                  r.points_per_cell));
  log(fmt::format("surfels       {}, {:.0f} % planar{}",
                  short_count(static_cast<double>(r.surfels)),
                  100.0 * static_cast<double>(r.planar_surfels) /
                      static_cast<double>(std::max<std::uint64_t>(1, r.surfels)),
                  r.has_intensity ? ", with intensity" : ""));
}

}  // namespace pointflight::apps
