#include "pointflight/fidelity/deskewing_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_set>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/time.hpp"
#include "pointflight/fidelity/real_beams.hpp"
#include "pointflight/fidelity/sensor_lines.hpp"
#include "pointflight/geometry/internal/grid_cells.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/survey/median.hpp"

namespace pointflight {
namespace {

constexpr double kCube = 0.15;               // m: one return in each
constexpr double kReachOfLines = 60.0;       // m
constexpr double kLargestResidual = 0.15;    // m off the plane: else it is of another surface
constexpr double kSteepest = 0.1;            // of the incidence
constexpr std::size_t kFewestReturns = 500;  // of a scan
constexpr std::size_t kFewestScans = 5;
constexpr int kIterations = 12;

using Unknowns = Eigen::Matrix<double, 12, 1>;  // pose: rotation, shift; over a scan: the same
using Products = Eigen::Matrix<double, 12, 12>;

/// At which share of a scan's duration a spinning sensor looks into a direction.
class AzimuthTimes {
 public:
  AzimuthTimes(const Lidar& lidar, const Executor& executor) : bins_(kBins) {
    const double period = to_seconds(lidar.period());
    for (const Beam& beam : lidar.beams(0, executor)) {
      Bin& bin = bins_[bin_of(beam.direction_sensor)];
      const double time = to_seconds(beam.time_offset) / period;
      bin.sum += time;
      bin.least = std::min(bin.least, time);
      bin.most = std::max(bin.most, time);
      bin.count += 1.0;
    }
  }

  /// Nothing where beams of several times leave: at the seam of a turn, and all around if the
  /// sensor does not spin.
  [[nodiscard]] std::optional<double> of(const Vector3f& direction_sensor) const {
    const Bin& bin = bins_[bin_of(direction_sensor)];
    if (bin.count == 0.0 || bin.most - bin.least > kSpread) return std::nullopt;
    return bin.sum / bin.count;
  }

 private:
  struct Bin {
    double sum = 0.0;
    double least = std::numeric_limits<double>::infinity();
    double most = -std::numeric_limits<double>::infinity();
    double count = 0.0;
  };
  static constexpr std::size_t kBins = 720;
  static constexpr double kSpread = 0.05;  // of a scan's duration

  static std::size_t bin_of(const Vector3f& direction) {
    const double azimuth =
        math::atan2(static_cast<double>(direction.y()), static_cast<double>(direction.x()));
    const auto bin = static_cast<std::size_t>((azimuth / kPi + 1.0) * (kBins / 2.0));
    return std::min(bin, kBins - 1);
  }

  std::vector<Bin> bins_;
};

/// One return beside the surface that it should lie on.
struct Residual {
  Unknowns by;       ///< m, for one of each unknown.
  double off = 0.0;  ///< m along the normal.
};

/// A scan's returns on planes of the map.
class ScanResiduals {
 public:
  ScanResiduals(const Lidar& lidar,
                std::size_t scans,
                const SurfelMap& map,
                const Renderer& renderer,
                const Executor& executor)
      : origins_(lidar, scans, executor),
        times_(lidar, executor),
        map_(map),
        renderer_(renderer),
        executor_(executor) {}

  [[nodiscard]] std::vector<Residual> of(const RealScan& scan) const {
    const RealBeams beams = thinned(origins_.of(scan));
    const std::vector<Hit> hits = render_lines(scan.T_world_sensor,
                                               beams.origins_sensor,
                                               beams.directions_sensor,
                                               static_cast<float>(kReachOfLines),
                                               renderer_,
                                               executor_);
    const Quaterniond to_sensor = scan.T_world_sensor.rotation.conjugate();
    std::vector<Residual> residuals;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      const Hit& hit = hits[i];
      if (!hit.is_return() || hit.surfel == kNoSurfel || hit.cos_incidence < kSteepest) continue;
      const SurfelWord word = map_.words()[hit.surfel];
      if (!is_planar(word)) continue;
      const Vector3d normal = to_sensor * decode(word).axes.col(0).cast<double>();
      const Vector3d direction = beams.directions_sensor[i].cast<double>();
      const double along = static_cast<double>(beams.ranges[i] - hit.range);
      const double off = along * direction.dot(normal);
      const std::optional<double> time = times_.of(beams.directions_sensor[i]);
      if (!time || std::abs(off) > kLargestResidual) continue;
      const Vector3d point =
          beams.origins_sensor[i].cast<double>() + static_cast<double>(beams.ranges[i]) * direction;
      Residual& residual = residuals.emplace_back();
      residual.by << point.cross(normal), normal, (*time - 0.5) * point.cross(normal),
          (*time - 0.5) * normal;
      residual.off = off;
    }
    return residuals;
  }

 private:
  /// One in each cube: near surfaces have most of the returns and tell least of a rotation.
  static RealBeams thinned(const RealBeams& beams) {
    std::unordered_set<std::uint64_t> taken;
    RealBeams kept;
    for (std::size_t i = 0; i < beams.ranges.size(); ++i) {
      const Vector3f point = beams.origins_sensor[i] + beams.ranges[i] * beams.directions_sensor[i];
      if (!taken.insert(grid_key(grid_cell(point.cast<double>(), kCube))).second) continue;
      kept.origins_sensor.push_back(beams.origins_sensor[i]);
      kept.directions_sensor.push_back(beams.directions_sensor[i]);
      kept.ranges.push_back(beams.ranges[i]);
    }
    return kept;
  }

  BeamOrigins origins_;
  AzimuthTimes times_;
  const SurfelMap& map_;
  const Renderer& renderer_;
  const Executor& executor_;
};

/// What explains a scan's residuals.
struct Explained {
  Unknowns values = Unknowns::Zero();
  Unknowns variances = Unknowns::Zero();
};

/// Nothing if they leave an unknown open.
std::optional<Explained> explain(const std::vector<Residual>& residuals) {
  Explained made;
  for (int i = 0; i < kIterations; ++i) {
    std::vector<double> distances;
    for (const Residual& r : residuals) {
      distances.push_back(std::abs(r.off - r.by.dot(made.values)));
    }
    const double sigma = 1.4826 * median(distances);
    if (!(sigma > 0.0)) return std::nullopt;
    const double scale = 2.0 * sigma;
    Products products = Products::Zero();
    Unknowns sums = Unknowns::Zero();
    for (std::size_t k = 0; k < residuals.size(); ++k) {
      const double u = distances[k] / scale;
      const double weight = 1.0 / (1.0 + u * u);
      products += weight * residuals[k].by * residuals[k].by.transpose();
      sums += weight * residuals[k].off * residuals[k].by;
    }
    const Eigen::LDLT<Products> solver(products);
    constexpr double kLeastPivot = 1e-6;  // of the largest: a corridor says nothing along it
    const auto pivots = solver.vectorD();
    if (!(pivots.minCoeff() > kLeastPivot * pivots.maxCoeff())) return std::nullopt;
    made.values = solver.solve(sums);
    made.variances = sigma * sigma * solver.solve(Products::Identity()).diagonal();
  }
  return made;
}

/// Of three components of each scan, of which `variances` are noise.
FittedSigma sigma_of(const std::vector<Explained>& scans, Eigen::Index first) {
  double sum = 0.0;
  double noise = 0.0;
  for (const Explained& scan : scans) {
    sum += scan.values.segment<3>(first).squaredNorm();
    noise += scan.variances.segment<3>(first).sum();
  }
  const double count = 3.0 * static_cast<double>(scans.size());
  const double variance = std::max(0.0, (sum - noise) / count);
  // of a variance of `count` normal draws; of the deviation half of that over it
  const double error = std::sqrt(2.0 / count) * sum / count;
  FittedSigma fitted;
  fitted.sigma = std::sqrt(variance);
  fitted.error = fitted.sigma > 0.0 ? 0.5 * error / fitted.sigma : std::sqrt(error);
  return fitted;
}

}  // namespace

DeskewingFit fit_deskewing(const std::vector<RealScan>& scans,
                           const LidarSettings& lidar,
                           const SurfelMap& map,
                           const Renderer& renderer,
                           const Executor& executor,
                           const Progress& progress) {
  DeskewingFit fit;
  const Lidar sensor(lidar, 0);
  const ScanResiduals residuals(sensor, 1, map, renderer, executor);
  std::vector<Explained> explained;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    report(progress,
           "looking for motion within scans",
           static_cast<double>(i) / static_cast<double>(scans.size()));
    const std::vector<Residual> of_scan = residuals.of(scans[i]);
    if (of_scan.size() < kFewestReturns) continue;
    if (const auto made = explain(of_scan)) explained.push_back(*made);
  }
  if (explained.size() < kFewestScans) return fit;
  for (const Explained& scan : explained) {
    fit.motions.push_back({scan.values.segment<3>(6), scan.values.segment<3>(9)});
  }
  fit.rotation = sigma_of(explained, 6);
  fit.translation = sigma_of(explained, 9);
  return fit;
}

}  // namespace pointflight
