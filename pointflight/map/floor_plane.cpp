#include "pointflight/map/floor_plane.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "pointflight/core/math.hpp"
#include "pointflight/map/internal/covariance_axes.hpp"

namespace pointflight {
namespace {

constexpr double kMostTilt = 0.577;       // tan 30 deg
constexpr std::size_t kFewest = 100;      // surfels that make a surface
constexpr std::size_t kSample = 200'000;  // surfels that are looked at

/// A planar surfel; the normal of one that lies flat points upwards.
struct Facet {
  Vector3d center;
  Vector3d normal;
};

struct Facets {
  std::vector<Facet> flat;
  std::vector<Facet> upright;
};

Facets sample_facets(std::span<const SurfelWord> words,
                     const Vector3d& origin_world,
                     double resolution,
                     const Pose& T) {
  Facets facets;
  const std::size_t step = words.size() / kSample + 1;
  std::size_t seen = 0;
  for_each_surfel(words, [&](const LeafHeader& leaf, std::size_t word) {
    if (seen++ % step != 0 || !is_planar(words[word])) return;
    const Surfel surfel = decode(words[word]);
    const Vector3d corner(leaf.x, leaf.y, leaf.z);
    const Vector3d center =
        origin_world + resolution * (corner + surfel.center_voxels.cast<double>());
    Facet facet{T * center, T.rotation * surfel.axes.col(0).cast<double>()};
    if (facet.normal.z() < 0.0) facet.normal = -facet.normal;
    const double sideways = facet.normal.head<2>().norm();
    if (sideways < kMostTilt * facet.normal.z()) {
      facets.flat.push_back(facet);
    } else if (facet.normal.z() < 0.35) {  // walls, up to 20 degrees off
      facets.upright.push_back(facet);
    }
  });
  return facets;
}

/// The direction that most normals share: the fullest bin of slopes, then the mean around it.
Vector3d commonest_normal(const std::vector<Facet>& flat) {
  constexpr int kBins = 61;
  constexpr double kWidth = 2.0 * kMostTilt / kBins;
  std::vector<std::uint32_t> counts(kBins * kBins, 0);
  const auto index = [](int i, int j) {
    return static_cast<std::size_t>(i) * kBins + static_cast<std::size_t>(j);
  };
  const auto bin_of = [](double slope) {
    return std::clamp(static_cast<int>((slope + kMostTilt) / kWidth), 0, kBins - 1);
  };
  for (const Facet& facet : flat) {
    const Vector3d& n = facet.normal;
    ++counts[index(bin_of(n.x() / n.z()), bin_of(n.y() / n.z()))];
  }
  std::uint32_t most = 0;
  Vector3d mode = Vector3d::UnitZ();
  for (int i = 0; i < kBins; ++i) {
    for (int j = 0; j < kBins; ++j) {
      std::uint32_t around = 0;
      for (int k = 0; k < 9; ++k) {
        const int a = std::clamp(i + k / 3 - 1, 0, kBins - 1);
        const int b = std::clamp(j + k % 3 - 1, 0, kBins - 1);
        around += counts[index(a, b)];
      }
      if (around <= most) continue;
      most = around;
      mode = Vector3d((i + 0.5) * kWidth - kMostTilt, (j + 0.5) * kWidth - kMostTilt, 1.0)
                 .normalized();
    }
  }
  constexpr double kNear = 0.9986;  // cos 3 deg
  for (int round = 0; round < 5; ++round) {
    Vector3d sum = Vector3d::Zero();
    for (const Facet& facet : flat) {
      if (facet.normal.dot(mode) > kNear) sum += facet.normal;
    }
    if (sum.norm() > 0.0) mode = sum.normalized();
  }
  return mode;
}

/// Where along `normal` the lowest layer lies that is at least half as full as the fullest.
double height_of_layer(const std::vector<Facet>& flat, const Vector3d& normal, double width) {
  std::vector<double> heights;
  heights.reserve(flat.size());
  for (const Facet& facet : flat) heights.push_back(facet.center.dot(normal));
  std::sort(heights.begin(), heights.end());
  // how many lie within `width` above each
  std::vector<std::size_t> counts(heights.size());
  std::size_t end = 0;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    while (end < heights.size() && heights[end] <= heights[i] + width) ++end;
    counts[i] = end - i;
  }
  const std::size_t most = *std::max_element(counts.begin(), counts.end());
  std::size_t at = 0;
  while (2 * counts[at] < most) ++at;
  // up to the top of that layer
  while (at + 1 < counts.size() && counts[at + 1] >= counts[at]) ++at;
  return heights[at] + 0.5 * width;
}

/// The centres within `reach` of the layer; refines normal and middle by their principal axes.
std::size_t refine(const std::vector<Facet>& flat, double reach, FloorPlane& plane) {
  const double height = height_of_layer(flat, plane.normal_world, reach);
  std::size_t count = 0;
  Vector3d sum = Vector3d::Zero();
  for (const Facet& facet : flat) {
    if (std::abs(facet.center.dot(plane.normal_world) - height) > reach) continue;
    sum += facet.center;
    ++count;
  }
  if (count == 0) return 0;
  plane.middle_world = sum / static_cast<double>(count);
  Matrix3d products = Matrix3d::Zero();
  for (const Facet& facet : flat) {
    if (std::abs(facet.center.dot(plane.normal_world) - height) > reach) continue;
    const Vector3d d = facet.center - plane.middle_world;
    products += d * d.transpose();
  }
  const CovarianceAxes axes = covariance_axes(products / static_cast<double>(count));
  Vector3d normal = axes.vectors.col(0);
  if (normal.z() < 0.0) normal = -normal;
  // a strip is too narrow to tell; the normals told already
  constexpr double kNear = 0.9986;  // cos 3 deg
  const bool wide = axes.lambda[1] > 25.0 * axes.lambda[0];
  if (wide && normal.dot(plane.normal_world) > kNear) plane.normal_world = normal;
  return count;
}

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Only walls that face along the slope show it.
FloorPlane::Walls ask_walls(const std::vector<Facet>& upright, const Vector3d& normal) {
  const Vector3d downhill = Vector3d(normal.x(), normal.y(), 0.0).normalized();
  std::vector<double> off_floor;
  std::vector<double> off_world;
  for (const Facet& facet : upright) {
    if (std::abs(facet.normal.dot(downhill)) < 0.6) continue;
    off_floor.push_back(std::abs(facet.normal.dot(normal)));
    off_world.push_back(std::abs(facet.normal.z()));
  }
  if (off_floor.size() < kFewest) return FloorPlane::Walls::kNone;
  return median_of(off_floor) < median_of(off_world) ? FloorPlane::Walls::kOnTheFloor
                                                     : FloorPlane::Walls::kInTheWorld;
}

std::optional<FloorPlane> floor_of(const Facets& facets, double resolution) {
  if (facets.flat.size() < kFewest) return std::nullopt;
  FloorPlane plane;
  plane.normal_world = commonest_normal(facets.flat);
  std::size_t count = 0;
  for (const double reach : {0.6, 0.3, 0.15, 0.15}) {
    count = refine(facets.flat, std::max(reach, 2.0 * resolution), plane);
  }
  if (count < kFewest) return std::nullopt;
  plane.share = static_cast<double>(count) / static_cast<double>(facets.flat.size());
  const Vector3d& n = plane.normal_world;
  plane.tilt = math::atan2(n.head<2>().norm(), n.z());
  if (plane.tilt > 0.0) plane.walls = ask_walls(facets.upright, n);
  return plane;
}

}  // namespace

Pose FloorPlane::levelling() const {
  Pose turn;
  turn.rotation = Quaterniond::FromTwoVectors(normal_world, Vector3d::UnitZ());
  turn.translation = middle_world - turn.rotation * middle_world;
  return turn;
}

std::optional<FloorPlane> find_floor(std::span<const SurfelWord> words,
                                     const Vector3d& origin_world,
                                     double resolution) {
  return floor_of(sample_facets(words, origin_world, resolution, {}), resolution);
}

std::optional<FloorPlane> find_floor(const SurfelMap& map, const Pose& T_world_map) {
  return floor_of(sample_facets(map.words(), map.origin_world(), map.resolution(), T_world_map),
                  map.resolution());
}

}  // namespace pointflight
