#include "apps/import_report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/terminal.hpp"

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

std::string about_noise(double noise, std::uint64_t projected, std::uint64_t too_thick) {
  return fmt::format(
      "{:.1f} mm across flat surfaces; {}",
      noise * 1e3,
      projected > 0
          ? fmt::format(
                "removed from {} cells; {} skipped (two parallel surfaces?)", projected, too_thick)
          : "too little to remove");
}

void print_report(const ImportReport& r, const ImportOptions& options) {
  log(fmt::format(
      "points        {} read{}{}",
      short_count(static_cast<double>(r.points_read)),
      r.points_not_finite > 0 ? fmt::format(", {} NaN or infinite dropped", r.points_not_finite)
                              : "",
      r.points_out_of_reach > 0 ? fmt::format(", {} too far away dropped", r.points_out_of_reach)
                                : ""));
  log(fmt::format("resolution    {:.4g} m{}",
                  r.resolution,
                  r.resolution_was_chosen ? " (chosen from the spacing)" : ""));
  log("spacing       " + about_spacing(r.spacing, r.resolution, r.supported_resolution));
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
