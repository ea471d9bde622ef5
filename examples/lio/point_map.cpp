#include "examples/lio/point_map.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace lio {
namespace {

constexpr double kFarthest = 1.0;   // m, of the five nearest
constexpr double kThickness = 0.1;  // m

}  // namespace

PointMap::Key PointMap::key_of(const Vector3d& point) {
  Key key;
  for (std::size_t i = 0; i < 3; ++i) {
    key[i] = static_cast<std::int32_t>(std::floor(point[static_cast<Eigen::Index>(i)] / kVoxel));
  }
  return key;
}

void PointMap::add(const Vector3d& point) {
  std::vector<Vector3d>& voxel = voxels_[key_of(point)];
  for (const Vector3d& other : voxel) {
    if ((other - point).squaredNorm() < kSpacing * kSpacing) return;
  }
  voxel.push_back(point);
  ++size_;
}

std::optional<Plane> PointMap::plane_at(const Vector3d& point) const {
  std::array<double, kNearest> distances;
  distances.fill(kFarthest * kFarthest);
  std::array<Vector3d, kNearest> nearest;
  std::size_t found = 0;
  const Key middle = key_of(point);
  for (int i = 0; i < 27; ++i) {
    const Key key = {middle[0] + i % 3 - 1, middle[1] + i / 3 % 3 - 1, middle[2] + i / 9 - 1};
    const auto voxel = voxels_.find(key);
    if (voxel == voxels_.end()) continue;
    for (const Vector3d& other : voxel->second) {
      const double distance = (other - point).squaredNorm();
      if (distance >= distances.back()) continue;
      // into its position among the nearest
      std::size_t at = std::min(found, kNearest - 1);
      for (; at > 0 && distances[at - 1] > distance; --at) {
        distances[at] = distances[at - 1];
        nearest[at] = nearest[at - 1];
      }
      distances[at] = distance;
      nearest[at] = other;
      found = std::min(found + 1, kNearest);
    }
  }
  if (found < kNearest) return std::nullopt;
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : nearest) mean += p / static_cast<double>(kNearest);
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : nearest) moments += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(moments);
  const Vector3d normal = axes.eigenvectors().col(0);
  // five points on a line are no plane
  if (axes.eigenvalues()[1] < 1e-3) return std::nullopt;
  for (const Vector3d& p : nearest) {
    if (std::abs(normal.dot(p - mean)) > kThickness) return std::nullopt;
  }
  return Plane{normal, normal.dot(mean)};
}

}  // namespace lio
