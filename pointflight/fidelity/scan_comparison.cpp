#include "pointflight/fidelity/scan_comparison.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {
namespace {

constexpr double kSupportRadius = 0.25;  // m
constexpr std::size_t kSupportPoints = 16;
constexpr float kRangeMax = 1000.0f;  // a late hit must be seen as late

/// Points in nanoflann's tree, as it asks for them.
struct PointTree {
  std::vector<Vector3f> points;  ///< World, from `origin`.
  Vector3d origin = Vector3d::Zero();

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return static_cast<double>(points[i][static_cast<int>(axis)]);
  }
  template <class Bounds>
  bool kdtree_get_bbox(Bounds& /*box*/) const {
    return false;
  }
  using Index = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointTree>,
                                                    PointTree,
                                                    3,
                                                    std::uint32_t>;
  std::unique_ptr<Index> index;

  void build() {
    index = std::make_unique<Index>(3, *this, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  }
};

/// nanoflann's result set that stops once enough points are found.
// NOLINTBEGIN(readability-identifier-naming): nanoflann asks for these names
class EnoughPoints {
 public:
  using DistanceType = double;
  EnoughPoints(double radius, std::size_t wanted) : squared_(radius * radius), wanted_(wanted) {}
  [[nodiscard]] bool addPoint(double squared, std::uint32_t /*index*/) {
    count_ += squared < squared_ ? 1 : 0;
    return count_ < wanted_;
  }
  [[nodiscard]] double worstDist() const { return squared_; }
  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] std::size_t size() const { return count_; }
  void sort() {}
  [[nodiscard]] bool enough() const { return count_ >= wanted_; }

 private:
  double squared_;
  std::size_t wanted_;
  std::size_t count_ = 0;
};

/// nanoflann's result set of all points within a radius, by their distance. (Its own one holds
/// pairs up to version 1.4 and a type of its own from 1.5 on.)
class PointsWithin {
 public:
  using DistanceType = double;
  struct Item {
    std::uint32_t index;
    double squared;
  };
  explicit PointsWithin(double radius) : squared_(radius * radius) {}
  bool addPoint(double squared, std::uint32_t index) {
    if (squared < squared_) items_.push_back({index, squared});
    return true;
  }
  [[nodiscard]] double worstDist() const { return squared_; }
  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] std::size_t size() const { return items_.size(); }
  void sort() { std::ranges::sort(items_, {}, &Item::squared); }
  void clear() { items_.clear(); }
  [[nodiscard]] const std::vector<Item>& items() const { return items_; }

 private:
  double squared_;
  std::vector<Item> items_;
};
// NOLINTEND(readability-identifier-naming)

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

struct SupportCloud::Tree : PointTree {};

SupportCloud::SupportCloud(const std::string& path) : tree_(std::make_unique<Tree>()) {
  const auto reader = open_cloud(path);
  std::vector<CloudPoint> batch;
  while (reader->read(batch)) {
    for (const CloudPoint& point : batch) {
      if (!point.position.allFinite()) continue;
      if (tree_->points.empty()) tree_->origin = point.position;
      tree_->points.emplace_back((point.position - tree_->origin).cast<float>());
    }
  }
  if (tree_->points.empty()) throw InputError(fmt::format("{}: no points", path));
  tree_->build();
}

SupportCloud::~SupportCloud() = default;

bool SupportCloud::supports(const Vector3d& point_world) const {
  EnoughPoints result(kSupportRadius, kSupportPoints);
  const Vector3d query = point_world - tree_->origin;
  tree_->index->findNeighbors(result, query.data(), {});
  return result.enough();
}

std::vector<ComparedRay> compare_scan(const RealScan& scan,
                                      const Renderer& renderer,
                                      const SupportCloud* cloud,
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
      if (cloud == nullptr) continue;
      compared[i].supported = cloud->supports(scan.rays[i].point_world());
    }
  });
  return compared;
}

struct ScanPlanes::Tree : PointTree {
  std::vector<std::uint32_t> scan;  ///< Of each point.
};

ScanPlanes::ScanPlanes(const std::vector<RealScan>& scans)
    : scans_(scans), tree_(std::make_unique<Tree>()) {
  if (!scans.empty()) tree_->origin = scans.front().T_world_sensor.translation;
  for (std::uint32_t i = 0; i < scans.size(); ++i) {
    for (const SurveyRay& ray : scans[i].rays) {
      tree_->points.emplace_back((ray.point_world() - tree_->origin).cast<float>());
      tree_->scan.push_back(i);
    }
  }
  tree_->build();
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
    PointsWithin near(kSupportRadius);
    for (std::size_t i = begin; i < end; ++i) {
      const SurveyRay& ray = own.rays[i * kStride];
      const Vector3d place = ray.point_world() - tree_->origin;
      near.clear();
      tree_->index->findNeighbors(near, place.data(), {});
      near.sort();
      Vector3d sum = Vector3d::Zero();
      Matrix3d products = Matrix3d::Zero();
      double n = 0.0;
      for (const auto& [index, squared] : near.items()) {
        if (tree_->scan[index] == scan) continue;
        const Vector3d q = tree_->points[index].cast<double>() - place;
        sum += q;
        products += q * q.transpose();
        n += 1.0;
      }
      if (n < static_cast<double>(kSupportPoints)) continue;
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

ErrorCollector collect(const std::vector<ComparedRay>& rays, bool supported_only) {
  ErrorCollector collector;
  for (const ComparedRay& ray : rays) {
    if (supported_only && !ray.supported) continue;
    std::optional<double> rendered;
    if (ray.rendered >= 0.0f) rendered = static_cast<double>(ray.rendered);
    collector.add(static_cast<double>(ray.range), rendered);
  }
  return collector;
}

}  // namespace pointflight
