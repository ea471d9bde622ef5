#include "pointflight/map/large_planes.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "pointflight/core/math.hpp"
#include "pointflight/geometry/internal/grid_cells.hpp"
#include "pointflight/map/internal/covariance_axes.hpp"

namespace pointflight {
namespace {

constexpr double kBlock = 1.0;            // m
constexpr double kFacetTilt = 0.966;      // cos 15 deg: of surfels in a patch
constexpr std::size_t kFewestFacets = 6;  // surfels of a patch
constexpr std::size_t kPatchesMost = 6;   // of a block
constexpr std::size_t kSeeds = 24;        // tried for a patch

/// A planar surfel.
struct PlaneFacet {
  Vector3f center;  ///< From the block's corner, m.
  Vector3f normal;
};

/// The facets near a seed's plane, and what they make.
class PatchFinder {
 public:
  PatchFinder(std::vector<PlaneFacet> facets, double resolution)
      : left_(std::move(facets)),
        resolution_(resolution),
        near_(static_cast<float>(std::max(0.5 * resolution, 0.03))) {}

  /// The patch with the most facets; its facets are taken. False if none has enough.
  bool next(PlanePatch& patch) {
    if (left_.size() < kFewestFacets) return false;
    PlaneFacet best;
    std::size_t most = 0;
    const std::size_t step = std::max<std::size_t>(1, left_.size() / kSeeds);
    for (std::size_t i = 0; i < left_.size(); i += step) {
      const std::size_t count = static_cast<std::size_t>(
          std::ranges::count_if(left_, [&](const PlaneFacet& f) { return is_in(left_[i], f); }));
      if (count > most) {
        most = count;
        best = left_[i];
      }
    }
    if (most < kFewestFacets) return false;
    for (int round = 0; round < 2; ++round) best = mean_of(best);
    const std::size_t before = left_.size();
    std::erase_if(left_, [&](const PlaneFacet& f) { return is_in(best, f); });
    const std::size_t taken = before - left_.size();
    if (taken < kFewestFacets) return false;
    patch.middle_world = best.center.cast<double>();
    patch.normal_world = best.normal.cast<double>().normalized();
    patch.area = static_cast<double>(taken) * resolution_ * resolution_;
    return true;
  }

 private:
  [[nodiscard]] bool is_in(const PlaneFacet& plane, const PlaneFacet& facet) const {
    return std::abs(plane.normal.dot(facet.normal)) > static_cast<float>(kFacetTilt) &&
           std::abs(plane.normal.dot(facet.center - plane.center)) < near_;
  }

  /// Of those in a plane.
  [[nodiscard]] PlaneFacet mean_of(const PlaneFacet& plane) const {
    Vector3d center = Vector3d::Zero();
    Vector3d normal = Vector3d::Zero();
    std::size_t count = 0;
    for (const PlaneFacet& f : left_) {
      if (!is_in(plane, f)) continue;
      center += f.center.cast<double>();
      normal += (plane.normal.dot(f.normal) < 0.0f ? -1.0 : 1.0) * f.normal.cast<double>();
      ++count;
    }
    if (count == 0) return plane;
    return {(center / static_cast<double>(count)).cast<float>(), normal.normalized().cast<float>()};
  }

  std::vector<PlaneFacet> left_;
  double resolution_;
  float near_;
};

/// Patches by the block that they were found in; patches of one block lie together.
std::vector<PlanePatch> find_patches(const SurfelMap& map, const Executor& executor) {
  const double width = std::max(kBlock, 8.0 * map.resolution());
  std::map<GridCell, std::vector<PlaneFacet>> blocks;
  for_each_surfel(map.words(), [&](const LeafHeader& leaf, std::size_t word) {
    const auto at = static_cast<std::uint32_t>(word);
    if (!is_planar(map.words()[word]) || map.is_assumed(at)) return;
    const Vector3d center = map.center_world(leaf, map.words()[word]);
    const GridCell cell = grid_cell(center, width);
    blocks[cell].push_back(
        {(center - grid_corner(cell, width)).cast<float>(), decode(map.words()[word]).axes.col(0)});
  });
  std::vector<std::pair<const GridCell, std::vector<PlaneFacet>>*> in_order;
  for (auto& block : blocks) in_order.push_back(&block);
  std::vector<std::vector<PlanePatch>> found(in_order.size());
  executor.parallel_for(in_order.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      PatchFinder finder(std::move(in_order[i]->second), map.resolution());
      PlanePatch patch;
      while (found[i].size() < kPatchesMost && finder.next(patch)) {
        patch.middle_world += grid_corner(in_order[i]->first, width);
        found[i].push_back(patch);
      }
    }
  });
  std::vector<PlanePatch> patches;
  for (const auto& some : found) patches.insert(patches.end(), some.begin(), some.end());
  return patches;
}

/// Which patches continue which.
class PlaneGrower {
 public:
  PlaneGrower(std::vector<PlanePatch> patches, double resolution, const LargePlaneOptions& options)
      : patches_(std::move(patches)),
        taken_(patches_.size(), false),
        options_(options),
        near_(options.gap),
        offset_(options.offset + 0.5 * resolution),
        cos_patch_(math::cos(options.patch_tilt / 180.0 * std::numbers::pi)),
        cos_plane_(math::cos(options.plane_tilt / 180.0 * std::numbers::pi)) {
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      near_.add(patches_[i].middle_world, i);
      order_.push_back(i);
    }
    std::ranges::stable_sort(
        order_, [&](std::size_t a, std::size_t b) { return patches_[a].area > patches_[b].area; });
  }

  /// The plane around the largest patch that is left; false if none is.
  bool next(LargePlane& plane) {
    while (at_ < order_.size() && taken_[order_[at_]]) ++at_;
    if (at_ == order_.size()) return false;
    plane = {};
    std::vector<std::size_t> open = {order_[at_]};
    taken_[order_[at_]] = true;
    Vector3d normals = Vector3d::Zero();
    Vector3d middles = Vector3d::Zero();
    double area = 0.0;
    for (std::size_t n = 0; n < open.size(); ++n) {
      PlanePatch& patch = patches_[open[n]];
      if (n > 0 && normals.dot(patch.normal_world) < 0.0) patch.normal_world = -patch.normal_world;
      normals += patch.area * patch.normal_world;
      middles += patch.area * patch.middle_world;
      area += patch.area;
      plane.patches.push_back(patch);
      const Vector3d mean = normals.normalized();
      near_.for_each_around(patch.middle_world, [&](std::size_t other) {
        const PlanePatch& next = patches_[other];
        if (taken_[other] || !continues(patch, next)) return;
        if (std::abs(mean.dot(next.normal_world)) < cos_plane_) return;
        taken_[other] = true;
        open.push_back(other);
      });
    }
    plane.normal_world = normals.normalized();
    plane.middle_world = middles / area;
    return true;
  }

 private:
  [[nodiscard]] bool continues(const PlanePatch& a, const PlanePatch& b) const {
    const Vector3d between = b.middle_world - a.middle_world;
    return between.norm() < options_.gap &&
           std::abs(a.normal_world.dot(b.normal_world)) > cos_patch_ &&
           std::abs(a.normal_world.dot(between)) < offset_ &&
           std::abs(b.normal_world.dot(between)) < offset_;
  }

  std::vector<PlanePatch> patches_;
  std::vector<bool> taken_;
  std::vector<std::size_t> order_;  ///< The largest first.
  std::size_t at_ = 0;
  LargePlaneOptions options_;
  GridIndex<std::size_t> near_;
  double offset_;
  double cos_patch_;
  double cos_plane_;
};

/// Long and wide enough.
bool is_large(const LargePlane& plane, const LargePlaneOptions& options) {
  double area = 0.0;
  for (const PlanePatch& patch : plane.patches) area += patch.area;
  if (area < options.area) return false;
  Matrix3d products = Matrix3d::Zero();
  for (const PlanePatch& patch : plane.patches) {
    const Vector3d d = patch.middle_world - plane.middle_world;
    products += patch.area * (d * d.transpose() + Matrix3d::Identity() * (patch.area / 12.0));
  }
  // of an evenly covered rectangle the variance along a side is its length squared / 12
  const CovarianceAxes axes = covariance_axes(products / area);
  return std::sqrt(12.0 * axes.lambda[2]) > options.length &&
         std::sqrt(12.0 * axes.lambda[1]) > options.width;
}

}  // namespace

std::vector<LargePlane> find_large_planes(const SurfelMap& map,
                                          const LargePlaneOptions& options,
                                          const Executor& executor) {
  PlaneGrower grower(find_patches(map, executor), map.resolution(), options);
  std::vector<LargePlane> planes;
  LargePlane plane;
  while (grower.next(plane)) {
    if (is_large(plane, options)) planes.push_back(std::move(plane));
  }
  std::ranges::stable_sort(planes, [](const LargePlane& a, const LargePlane& b) {
    return a.patches.size() > b.patches.size();
  });
  return planes;
}

}  // namespace pointflight
