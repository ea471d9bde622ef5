#include "pointflight/fidelity/scan_comparison.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "pointflight/geometry/internal/point_tree-inl.hpp"

namespace pointflight {
namespace {

constexpr double kPlaneRadius = 0.25;  // m, of points of other scans
constexpr double kPlanePoints = 16.0;  // at least
constexpr float kRangeMax = 1000.0f;   // a late hit must be seen as late

using FloatTree = PointTree<Vector3f>;

}  // namespace

std::vector<RealScan> read_real_scans(const SurveySource& survey, const Progress& progress) {
  std::vector<RealScan> scans;
  for (std::size_t i = 0; i < survey.scan_count(); ++i) {
    scans.push_back({survey.name(i), survey.pose(i), {}});
  }
  std::vector<SurveyRay> batch;
  const auto reader = survey.open();
  while (reader->read(batch)) {
    report(progress, "reading scans", reader->share_read());
    std::vector<SurveyRay>& rays = scans[reader->scan()].rays;
    for (const SurveyRay& ray : batch) {
      if (ray.is_return) rays.push_back(ray);
    }
  }
  return scans;
}

std::vector<ComparedRay> compare_scan(const RealScan& scan,
                                      const Renderer& renderer,
                                      const SurfelMap& map,
                                      const SupportedCells* cloud,
                                      const Executor& executor) {
  std::vector<Ray> rays;
  std::vector<ComparedRay> compared(scan.rays.size());
  rays.reserve(scan.rays.size());
  for (std::size_t i = 0; i < scan.rays.size(); ++i) {
    compared[i].range = scan.rays[i].range;
    rays.push_back({scan.rays[i].origin_world, scan.rays[i].direction_world, kRangeMax});
  }
  std::vector<Hit> hits(rays.size());
  RayBatch batch;
  batch.rays = rays;
  batch.T_world_sensor = scan.T_world_sensor;
  batch.range_max = kRangeMax;
  renderer.render(batch, hits, executor);
  executor.parallel_for(compared.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (hits[i].is_return()) compared[i].rendered = hits[i].range;
      compared[i].assumed = map.is_assumed(hits[i].surfel);
      if (cloud == nullptr) continue;
      compared[i].supported = cloud->has(scan.rays[i].point_world());
    }
  });
  return compared;
}

struct ScanPlanes::Tree {
  Vector3d origin;  ///< World; the points are given from here.
  FloatTree points;
  std::vector<std::uint32_t> scan;  ///< Of each point.
};

ScanPlanes::ScanPlanes(const std::vector<RealScan>& scans) : scans_(scans) {
  Vector3d origin = Vector3d::Zero();
  if (!scans.empty()) origin = scans.front().T_world_sensor.translation;
  std::vector<Vector3f> points;
  std::vector<std::uint32_t> scan_of;
  for (std::uint32_t i = 0; i < scans.size(); ++i) {
    for (const SurveyRay& ray : scans[i].rays) {
      points.emplace_back((ray.point_world() - origin).cast<float>());
      scan_of.push_back(i);
    }
  }
  tree_ = std::make_unique<Tree>(Tree{origin, FloatTree(std::move(points)), std::move(scan_of)});
}

ScanPlanes::~ScanPlanes() = default;

ErrorCollector ScanPlanes::compare(std::size_t scan, const Executor& executor) const {
  constexpr std::size_t kStride = 5;  // a fifth of the rays tells as much
  constexpr double kFlat = 0.01;      // least over middle variance
  const RealScan& own = scans_[scan];
  const std::size_t count = (own.rays.size() + kStride - 1) / kStride;
  // NaN if there is no plane
  std::vector<double> ranges(count, std::numeric_limits<double>::quiet_NaN());
  executor.parallel_for(count, 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const SurveyRay& ray = own.rays[i * kStride];
      const Vector3d position = ray.point_world() - tree_->origin;
      Vector3d sum = Vector3d::Zero();
      Matrix3d products = Matrix3d::Zero();
      double n = 0.0;
      for (const auto& [index, squared] : tree_->points.within(position, kPlaneRadius)) {
        if (tree_->scan[index] == scan) continue;
        const Vector3d q = tree_->points.points()[index].cast<double>() - position;
        sum += q;
        products += q * q.transpose();
        n += 1.0;
      }
      if (n < kPlanePoints) continue;
      const Vector3d mean = sum / n;
      const Eigen::SelfAdjointEigenSolver<Matrix3d> axes(products / n - mean * mean.transpose());
      if (axes.eigenvalues()[0] > kFlat * axes.eigenvalues()[1]) continue;
      const Vector3d normal = axes.eigenvectors().col(0);
      const double slope = normal.dot(ray.direction_world.cast<double>());
      if (std::abs(slope) < 0.02) continue;
      ranges[i] = static_cast<double>(ray.range) + normal.dot(mean) / slope;
    }
  });
  ErrorCollector collector;
  for (std::size_t i = 0; i < count; ++i) {
    if (std::isnan(ranges[i])) continue;
    collector.add(static_cast<double>(own.rays[i * kStride].range), ranges[i]);
  }
  return collector;
}

ErrorCollector collect(const std::vector<ComparedRay>& rays,
                       const std::function<bool(const ComparedRay&)>& counts) {
  ErrorCollector collector;
  for (const ComparedRay& ray : rays) {
    if (!counts(ray)) continue;
    std::optional<double> rendered;
    if (ray.rendered >= 0.0f) rendered = static_cast<double>(ray.rendered);
    collector.add(static_cast<double>(ray.range), rendered);
  }
  return collector;
}

}  // namespace pointflight
