#include "pointflight/map/outliers.hpp"

#include <cmath>
#include <nanoflann.hpp>

namespace pointflight {
namespace {

constexpr double kStandsOut = 2.0;  // times the mean distance of the neighbours
constexpr double kFarInCells = 10.0;

/// nanoflann's view of the centroids.
struct Centroids {
  std::vector<Vector3d> points;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<int>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};

using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Centroids>,
                                                 Centroids,
                                                 3,
                                                 std::uint32_t>;

}  // namespace

std::vector<std::uint32_t> find_outliers(const VoxelGrid& grid,
                                         const OutlierOptions& options,
                                         const Executor& executor) {
  const auto& cells = grid.cells();
  const auto k = static_cast<std::size_t>(options.neighbours);
  if (!options.enabled || cells.size() <= k) return {};
  Centroids centroids;
  centroids.points.reserve(cells.size());
  for (const VoxelCell& cell : cells) centroids.points.push_back(grid.centroid_world(cell));
  const Tree tree(3, centroids, nanoflann::KDTreeSingleIndexAdaptorParams(16));

  std::vector<double> distance(cells.size());
  std::vector<std::uint32_t> neighbours(cells.size() * k);
  executor.parallel_for(cells.size(), 4096, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> index(k + 1);
    std::vector<double> squared(k + 1);
    for (std::size_t i = begin; i < end; ++i) {
      tree.knnSearch(centroids.points[i].data(), k + 1, index.data(), squared.data());
      double sum = 0.0;
      for (std::size_t j = 1; j <= k; ++j) {  // 0 is the cell itself
        sum += std::sqrt(squared[j]);
        neighbours[i * k + j - 1] = index[j];
      }
      distance[i] = sum / static_cast<double>(k);
    }
  });

  double mean = 0.0;
  for (const double d : distance) mean += d;
  mean /= static_cast<double>(distance.size());
  double variance = 0.0;
  for (const double d : distance) variance += (d - mean) * (d - mean);
  variance /= static_cast<double>(distance.size());
  const double limit = mean + options.sigmas * std::sqrt(variance);

  std::vector<std::uint32_t> outliers;
  for (std::size_t i = 0; i < distance.size(); ++i) {
    if (distance[i] <= limit) continue;
    double around = 0.0;
    for (std::size_t j = 0; j < k; ++j) around += distance[neighbours[i * k + j]];
    const bool stands_out = distance[i] > kStandsOut * around / static_cast<double>(k);
    if (stands_out || distance[i] > kFarInCells * grid.resolution()) {
      outliers.push_back(static_cast<std::uint32_t>(i));
    }
  }
  return outliers;
}

}  // namespace pointflight
