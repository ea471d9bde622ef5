#include "pointflight/map/import/internal/import_metadata.hpp"

#include <nlohmann/json.hpp>

#include "pointflight/core/version.hpp"

namespace pointflight {

std::string import_metadata(const ImportReport& report, const ImportOptions& options) {
  nlohmann::ordered_json json;
  json["pointflight"] = kVersion;
  json["sources"] = report.sources;
  json["scale"] = options.scale;
  json["up"] = std::string(1, options.up);
  if (!options.shift.isZero(0.0)) {
    json["shift"] = {options.shift.x(), options.shift.y(), options.shift.z()};
  }
  json["resolution"] = report.resolution;
  json["resolution_was_chosen"] = report.resolution_was_chosen;
  json["resolution_was_tried"] = report.resolution_was_tried;
  json["point_spacing"] = report.spacing;
  json["supported_resolution"] = report.supported_resolution;
  json["points_read"] = report.points_read;
  json["points_not_finite"] = report.points_not_finite;
  json["points_out_of_reach"] = report.points_out_of_reach;
  json["cells"] = report.cells;
  json["outlier_removal"] = {{"enabled", options.outliers.enabled},
                             {"neighbours", options.outliers.neighbours},
                             {"sigmas", options.outliers.sigmas},
                             {"cells_dropped", report.outlier_cells},
                             {"points_dropped", report.outlier_points}};
  json["noise"] = report.noise;
  json["projection"] = {{"kept", report.projection.kept},
                        {"projected", report.projection.projected},
                        {"too_thick", report.projection.too_thick}};
  json["surfels"] = report.surfels;
  json["merged_surfels"] = report.merged_surfels;
  json["wide_surfels"] = report.wide_surfels;
  json["small_surfels"] = report.small_surfels;
  json["planar_surfels"] = report.planar_surfels;
  json["points_per_planar_cell"] = report.points_per_cell;
  json["tau"] = static_cast<double>(report.tau);
  json["grown_surfels"] = report.grown_surfels;
  json["has_intensity"] = report.has_intensity;
  if (report.intensity_from_colors) json["intensity"] = "luminance of the colours";
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace pointflight
