#include "pointflight/fidelity/scan_noise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pointflight/fidelity/sensor_lines.hpp"
#include "pointflight/geometry/internal/point_tree-inl.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/map/internal/covariance_axes.hpp"
#include "pointflight/survey/median.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kEvery = 7;          // point
constexpr double kNearRadius = 0.15;       // m
constexpr double kRadiusPerRange = 0.025;  // farther away
constexpr std::size_t kFewestNear = 12;
constexpr double kRoughness = 0.006;    // m, of the map
constexpr double kBreadth = 0.05;       // middle over largest variance of a plane
constexpr double kSameNormal = 0.9;     // cosine between the map's and the scan's
constexpr float kFarthestHit = 100.0f;  // m
constexpr float kFarthestOff = 0.15f;   // m: what was measured and what is there
constexpr double kLeastCosine = 0.5;    // of the incidence
constexpr double kPerMedian = 1.4826;   // deviation of a normal distribution per median magnitude

using ScanTree = PointTree<Vector3f>;

/// Distances of points from planes, m, by range.
using Residuals = std::array<std::vector<double>, NoiseComparison::kRanges.size() - 1>;

/// Points of a scan that lie near the map, and where the map is along their rays, m in the sensor
/// frame.
struct MappedScan {
  std::vector<Vector3f> measured;
  std::vector<Vector3f> mapped;
};

MappedScan mapped_scan(const std::vector<Vector3f>& points,
                       const Pose& T_world_sensor,
                       const Renderer& renderer,
                       const Executor& executor) {
  std::vector<Vector3f> directions;
  directions.reserve(points.size());
  for (const Vector3f& point : points) directions.push_back(point.normalized());
  const std::vector<Hit> hits =
      render_lines(T_world_sensor, {}, directions, kFarthestHit, renderer, executor);
  MappedScan scan;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const float off = hits[i].range - points[i].norm();
    if (!hits[i].is_return() || std::abs(off) > kFarthestOff) continue;
    scan.mapped.push_back(hits[i].range * directions[i]);
    scan.measured.push_back(points[i]);
  }
  return scan;
}

/// Some points of a scan, and how they are spread.
struct Patch {
  Vector3d mean;
  CovarianceAxes axes;

  [[nodiscard]] Vector3d normal() const { return axes.vectors.col(0); }
  /// Neither rough nor a line.
  [[nodiscard]] bool is_plane() const {
    return std::sqrt(axes.lambda[0]) <= kRoughness && axes.lambda[1] >= kBreadth * axes.lambda[2];
  }
};

/// Those near a point, without itself.
Patch patch_of(const std::vector<Vector3f>& points,
               const std::vector<ScanTree::Near>& near,
               std::size_t point) {
  const Vector3d position = points[point].cast<double>();
  Vector3d sum = Vector3d::Zero();
  Matrix3d products = Matrix3d::Zero();
  for (const auto& [index, squared] : near) {
    if (index == point) continue;
    const Vector3d q = points[index].cast<double>() - position;
    sum += q;
    products += q * q.transpose();
  }
  const auto n = static_cast<double>(near.size() - 1);
  const Vector3d mean = sum / n;
  return {position + mean, covariance_axes(products / n - mean * mean.transpose())};
}

/// Distance of one point from the plane of those around it, along its ray, m; NaN if the map has no
/// plane there.
double residual_of(const ScanTree& mapped,
                   const std::vector<Vector3f>& measured,
                   std::size_t point) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const Vector3d position = mapped.points()[point].cast<double>();
  const double range = position.norm();
  const auto near = mapped.within(position, std::max(kNearRadius, kRadiusPerRange * range));
  if (near.size() <= kFewestNear) return kNone;
  const Patch in_map = patch_of(mapped.points(), near, point);
  if (!in_map.is_plane()) return kNone;
  const Patch patch = patch_of(measured, near, point);
  const Vector3d normal = patch.normal();
  if (std::abs(normal.dot(in_map.normal())) < kSameNormal) return kNone;
  const double cosine = normal.dot(position) / range;
  if (std::abs(cosine) < kLeastCosine) return kNone;
  return normal.dot(measured[point].cast<double>() - patch.mean) / cosine;
}

void add_residuals(const MappedScan& scan, Residuals& residuals, const Executor& executor) {
  if (scan.mapped.empty()) return;
  const ScanTree tree(scan.mapped);
  const std::size_t count = (tree.points().size() + kEvery - 1) / kEvery;
  std::vector<double> found(count);
  executor.parallel_for(count, 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      found[i] = residual_of(tree, scan.measured, i * kEvery);
    }
  });
  for (std::size_t i = 0; i < count; ++i) {
    if (!std::isfinite(found[i])) continue;
    const auto range = static_cast<double>(tree.points()[i * kEvery].norm());
    for (std::size_t k = 0; k < residuals.size(); ++k) {
      if (range < NoiseComparison::kRanges[k] || range >= NoiseComparison::kRanges[k + 1]) continue;
      residuals[k].push_back(std::abs(found[i]));
    }
  }
}

}  // namespace

NoiseComparison compare_noise(const std::vector<RealScan>& scans,
                              const LidarSettings& lidar,
                              const Surroundings& surroundings,
                              const Renderer& renderer,
                              const Executor& executor,
                              const Progress& progress) {
  const Lidar sensor(lidar, 0, nullptr, surroundings);
  Residuals real;
  Residuals modelled;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    report(progress,
           "measuring the noise of ranges",
           static_cast<double>(i) / static_cast<double>(scans.size()));
    const RealScan& scan = scans[i];
    std::vector<Vector3f> points;
    points.reserve(scan.rays.size());
    for (std::size_t k = 0; k < scan.rays.size(); ++k) points.push_back(scan.point_sensor(k));
    add_residuals(mapped_scan(points, scan.T_world_sensor, renderer, executor), real, executor);
    ScanRequest request;
    request.index = i;
    const Scan made = sensor.take(request, PoseTrack(scan.T_world_sensor), renderer, executor);
    points.clear();
    for (const ScanPoint& point : made.points) points.push_back(point.position_sensor);
    add_residuals(mapped_scan(points, scan.T_world_sensor, renderer, executor), modelled, executor);
  }
  NoiseComparison noise;
  for (std::size_t k = 0; k < noise.bins.size(); ++k) {
    noise.bins[k] = {kPerMedian * median(real[k]),
                     kPerMedian * median(modelled[k]),
                     real[k].size(),
                     modelled[k].size()};
  }
  return noise;
}

}  // namespace pointflight
