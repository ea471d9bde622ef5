#include "pointflight/map/import/import_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

constexpr double kSparsest = 2.0;     // m between points: what a drone hits has to show
constexpr double kSmallest = 1.0;     // m, of the whole world
constexpr double kWidestMesh = 50e3;  // m
constexpr double kHighest = 5e3;      // m, of the whole world
constexpr double kHighestMesh = 1e3;  // m: a hall in millimetres is higher
constexpr double kUsualWidth = 50.0;  // m

/// The unit among a few in which the world would be as wide as places to fly in are.
double likely_factor(double width) {
  double best = 1.0;
  double best_ratio = std::numeric_limits<double>::infinity();
  for (const double factor : {1e-3, 1e-2, 1e2, 1e3}) {
    const double would_be = width * factor;
    const double ratio = std::max(would_be / kUsualWidth, kUsualWidth / would_be);
    if (ratio >= best_ratio) continue;
    best = factor;
    best_ratio = ratio;
  }
  return best;
}

std::string about_unit(const SourceUnit& named, double scale) {
  if (named.unit.metres == 0.0) {
    return fmt::format(
        "{}: its header says that coordinates are degrees, not lengths; project them first (to "
        "UTM, for instance)",
        named.source);
  }
  return fmt::format(
      "{}: its header says that coordinates are in units of a {}; --scale {:.7g} "
      "makes them metres{}",
      named.source,
      named.unit.name,
      named.unit.metres,
      scale == 1.0 ? "" : fmt::format(", and --scale {:.7g} was given", scale));
}

std::string about_steps(const CoarseSource& coarse, double scale) {
  return fmt::format(
      "{}: coordinates up to {:.3g} are stored in steps of {:.3g} m (single precision, or too few "
      "digits): surfaces are rough and have holes; shift the cloud near zero before it is saved, "
      "or save it with doubles",
      coarse.source,
      coarse.coordinates.farthest,
      coarse.coordinates.step * scale);
}

std::string about_size(const ImportReport& report, const Vector3d& size, double scale) {
  const double width = size.maxCoeff();
  const bool sparse = !report.has_mesh && report.spacing > kSparsest;
  const bool wide = report.has_mesh && width > kWidestMesh;
  const double highest = report.has_mesh ? kHighestMesh : kHighest;
  if (!sparse && !wide && size.z() < highest && width > kSmallest) return {};
  const double factor = likely_factor(width);
  const std::string apart = report.has_mesh || report.spacing <= 0.0
                                ? std::string()
                                : fmt::format(" with points {:.3g} m apart", report.spacing);
  return fmt::format(
      "{:.3g} x {:.3g} x {:.3g} m{} is no place to fly in; are the files in another unit? --scale "
      "{:.3g} would make it {:.3g} x {:.3g} x {:.3g} m",
      size.x(),
      size.y(),
      size.z(),
      apart,
      scale * factor,
      size.x() * factor,
      size.y() * factor,
      size.z() * factor);
}

}  // namespace

std::string floor_warning(const FloorPlane& floor) {
  // upright walls on a tilted floor: a ramp; upright on the floor: the whole map is tilted
  if (floor.walls == FloorPlane::Walls::kInTheWorld) return {};
  const bool walls_agree = floor.walls == FloorPlane::Walls::kOnTheFloor;
  const double degrees = floor.tilt / kDegree;
  const double most = walls_agree ? 1.0 : 2.5;    // deg; courts drain at 1 to 2
  const double share = walls_agree ? 0.25 : 0.6;  // hills are in no plane
  if (degrees < most || floor.share < share) return {};
  return fmt::format(
      "the floor is tilted by {:.1f} degrees{}; level the map: pointflight map transform MAP -o "
      "LEVEL.pfmap --level",
      degrees,
      walls_agree ? " and the walls with it" : " (leave it if this is a slope)");
}

std::vector<std::string> import_warnings(const ImportReport& report,
                                         const ImportOptions& options,
                                         const Aabb& bounds_world) {
  std::vector<std::string> warnings;
  for (const SourceUnit& named : report.units) {
    const double off = named.unit.metres / options.scale - 1.0;
    if (std::abs(off) > 1e-3) warnings.push_back(about_unit(named, options.scale));
  }
  for (const CoarseSource& coarse : report.coarse) {
    warnings.push_back(about_steps(coarse, options.scale));
  }
  for (const std::string& source : report.y_up) {
    if (options.up == 'z') {
      warnings.push_back(fmt::format("{}: its header says that y is up; --up y turns it", source));
    }
  }
  if (!bounds_world.empty() && report.surfels > 1) {
    const std::string size = about_size(report, bounds_world.size(), options.scale);
    if (!size.empty()) warnings.push_back(size);
  }
  if (report.floor) {
    const std::string level = floor_warning(*report.floor);
    if (!level.empty()) warnings.push_back(level);
  }
  return warnings;
}

void check_options(const ImportOptions& options) {
  const auto check = [](bool fine, const char* what) {
    if (!fine) throw InputError(fmt::format("import: {}", what));
  };
  check(!options.resolution || (*options.resolution > 0.0 && std::isfinite(*options.resolution)),
        "the resolution has to be a number of metres above 0");
  check(options.scale > 0.0 && std::isfinite(options.scale), "the scale has to be above 0");
  check(options.shift.allFinite(), "the shift has to be finite");
  check(options.up == 'z' || options.up == 'y', "up is 'y' or 'z'");
  check(!options.tau || (*options.tau >= 0.01f && *options.tau <= 1.0f),
        "tau has to lie between 0.01 and 1");
  check(options.outliers.neighbours > 0 && options.outliers.sigmas >= 0.0,
        "outliers want a neighbour or more, and deviations of 0 or more");
}

}  // namespace pointflight
