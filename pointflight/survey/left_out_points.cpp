#include "pointflight/survey/left_out_points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/hash.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/internal/point_tree-inl.hpp"
#include "pointflight/map/internal/covariance_axes.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kCandidates = 64;  // positions
constexpr std::size_t kTargets = 640;    // a position
constexpr std::size_t kFewestRays = 100;
constexpr double kLeastSeen = 0.5;        // of what is seen from the best position
constexpr double kClear = 0.7;            // m around a position
constexpr double kNearestTarget = 0.5;    // m
constexpr double kFarthestTarget = 30.0;  // m
constexpr double kSupportRadius = 0.25;   // m
constexpr std::size_t kSupportPoints = 16;
constexpr double kFlat = 0.01;   // least over middle variance
constexpr double kTouch = 0.3;   // spacings
constexpr double kBeside = 3.0;  // spacings
constexpr double kFreeAngle = 150.0 / 180.0 * std::numbers::pi;

using FloatTree = PointTree<Vector3f>;

/// What the points near a position are like.
struct Surface {
  std::vector<FloatTree::Near> near;  ///< The nearest first.
  CovarianceAxes axes;                ///< Of all of them.

  [[nodiscard]] bool is_flat() const { return axes.lambda[0] < kFlat * axes.lambda[1]; }
  [[nodiscard]] Vector3d normal() const { return axes.vectors.col(0); }
};

/// Of fewer points than 16 nothing is said: `near` is empty.
Surface surface_at(const FloatTree& tree, const Vector3d& position) {
  Surface surface;
  surface.near = tree.within(position, kSupportRadius);
  if (surface.near.size() < kSupportPoints) return {};
  Vector3d mean = Vector3d::Zero();
  for (const auto& [index, squared] : surface.near) mean += tree.points()[index].cast<double>();
  mean /= static_cast<double>(surface.near.size());
  Matrix3d products = Matrix3d::Zero();
  for (const auto& [index, squared] : surface.near) {
    const Vector3d q = tree.points()[index].cast<double>() - mean;
    products += q * q.transpose();
  }
  surface.axes = covariance_axes(products / static_cast<double>(surface.near.size()));
  return surface;
}

/// A point of the cloud as a ray passes it.
struct Passed {
  double along;  ///< m from the ray's origin.
  double angle;  ///< Around the ray, rad.
};

/// True if points lie all around: none of the gaps between their angles is `kFreeAngle` wide.
bool surround(std::span<const Passed> passed) {
  std::vector<double> angles;
  angles.reserve(passed.size());
  for (const Passed& one : passed) angles.push_back(one.angle);
  std::sort(angles.begin(), angles.end());
  double widest = angles.front() + 2.0 * std::numbers::pi - angles.back();
  for (std::size_t i = 1; i < angles.size(); ++i) {
    widest = std::max(widest, angles[i] - angles[i - 1]);
  }
  return widest < kFreeAngle;
}

/// Whether the cloud hides what lies `free` m or more along a ray.
bool hides(const FloatTree& tree,
           double spacing,
           const Vector3d& origin,
           const Vector3d& direction,
           double free) {
  constexpr double kFirst = 0.2;  // m
  const double radius = kBeside * spacing;
  const Vector3d right = direction.unitOrthogonal();
  const Vector3d up = direction.cross(right);
  std::vector<Passed> passed;
  for (double t = kFirst + 0.5 * radius; t < free + 0.5 * radius; t += radius) {
    // a ball around each piece of a cylinder
    for (const auto& [index, squared] : tree.within(origin + t * direction, 1.12 * radius)) {
      const Vector3d q = tree.points()[index].cast<double>() - origin;
      const double along = q.dot(direction);
      if (along < t - 0.5 * radius || along >= t + 0.5 * radius || along >= free) continue;
      const double x = q.dot(right);
      const double y = q.dot(up);
      const double aside = std::sqrt(x * x + y * y);
      if (aside < kTouch * spacing) return true;
      if (aside < radius) passed.push_back({along, math::atan2(y, x)});
    }
  }
  std::ranges::sort(passed, {}, &Passed::along);
  // surfaces one by one: points that follow each other closely
  for (std::size_t begin = 0, end = 0; begin < passed.size(); begin = end) {
    for (end = begin + 1; end < passed.size(); ++end) {
      if (passed[end].along - passed[end - 1].along >= radius) break;
      if (passed[end].along - passed[begin].along >= 3.0 * radius) break;
    }
    if (surround(std::span(passed).subspan(begin, end - begin))) return true;
  }
  return false;
}

/// Positions where a sensor could be.
std::vector<Vector3d> candidates_in(const FloatTree& tree) {
  constexpr std::uint64_t kTries = 20000;
  const RandomStream random(0, StreamId::kLeftOutPoints, 0);
  std::vector<Vector3d> positions;
  for (std::uint64_t i = 0; i < kTries && positions.size() < kCandidates; ++i) {
    const auto [which, height] = random.uniform2(i);
    const auto count = static_cast<double>(tree.points().size());
    const Vector3d ground = tree.points()[static_cast<std::size_t>(which * count)].cast<double>();
    const Vector3d position = ground + Vector3d(0.0, 0.0, 0.8 + height);
    if (tree.has_within(position, kClear, 1)) continue;
    const Surface surface = surface_at(tree, ground);
    if (surface.near.empty() || std::abs(surface.normal().z()) < 0.8) continue;
    positions.push_back(position);
  }
  return positions;
}

/// Points that are left out, as they lie around a position.
struct Targets {
  std::vector<std::size_t> points;  ///< Some, evenly.
  std::size_t directions = 0;       ///< In which there is one.
};

/// In all directions that are less than 45 degrees up or down, the nearest each: cells on the sides
/// of a cube.
Targets targets_from(const FloatTree& tree, const Vector3d& position) {
  constexpr int kCells = 96;
  constexpr std::size_t kNone = ~std::size_t{0};
  struct Target {
    double squared = std::numeric_limits<double>::infinity();
    std::size_t point = kNone;
  };
  std::vector<Target> cells(std::size_t{4} * kCells * kCells);
  for (std::size_t i = 0; i < tree.points().size(); ++i) {
    if (!is_left_out(i)) continue;
    const Vector3d d = tree.points()[i].cast<double>() - position;
    const double squared = d.squaredNorm();
    const double distance = std::sqrt(squared);
    if (distance < kNearestTarget || distance > kFarthestTarget) continue;
    const bool by_x = std::abs(d.x()) >= std::abs(d.y());
    const double depth = by_x ? d.x() : d.y();
    const double size = std::abs(depth);
    if (std::abs(d.z()) >= size) continue;
    const auto cell = [&](double v) {
      return std::clamp(static_cast<int>(0.5 * (v / size + 1.0) * kCells), 0, kCells - 1);
    };
    const int side = (by_x ? 0 : 2) + (depth > 0.0 ? 1 : 0);
    const int at = (side * kCells + cell(by_x ? d.y() : d.x())) * kCells + cell(d.z());
    Target& target = cells[static_cast<std::size_t>(at)];
    if (squared < target.squared) target = {squared, i};
  }
  std::erase_if(cells, [](const Target& target) { return target.point == kNone; });
  Targets targets{{}, cells.size()};
  const std::size_t count = std::min(cells.size(), kTargets);
  for (std::size_t k = 0; k < count; ++k) {
    targets.points.push_back(cells[k * cells.size() / count].point);
  }
  return targets;
}

/// Somewhere between a point and one of its nearest neighbours.
Vector3d position_beside(const FloatTree& tree,
                         std::size_t point,
                         const Surface& surface,
                         std::uint32_t number) {
  constexpr double kNeighbours = 6.0;
  const auto [which, share] = RandomStream(0, StreamId::kLeftOutPoints, 1 + number)
                                  .uniform2(static_cast<std::uint64_t>(point));
  const Vector3d position = tree.points()[point].cast<double>();
  const std::size_t neighbour = 1 + static_cast<std::size_t>(which * kNeighbours);
  const std::uint32_t other = surface.near[neighbour].index;
  return position + share * (tree.points()[other].cast<double>() - position);
}

/// What one position sees.
struct SeenFrom {
  std::vector<LeftOutRay> rays;
  std::size_t supported = 0;  ///< Rays to surfaces, hidden ones included.

  std::size_t directions = 0;

  /// Directions in which it sees a surface, estimated.
  [[nodiscard]] double seen() const {
    return static_cast<double>(directions) * static_cast<double>(rays.size()) /
           static_cast<double>(supported);
  }
};

/// How much of a ray's end, m, is its own surface, which hides nothing.
double own_length(const Surface& surface, const Vector3d& direction, double range, double spacing) {
  if (!surface.is_flat()) return kSupportRadius;
  const double sine = std::max(std::abs(surface.normal().dot(direction)), 0.03);
  return std::max(kSupportRadius, std::min(0.8 * range, 1.5 * spacing / sine));
}

SeenFrom seen_from(const FloatTree& tree, double spacing, const Vector3d& origin) {
  SeenFrom seen;
  const Targets targets = targets_from(tree, origin);
  seen.directions = targets.directions;
  for (const std::size_t point : targets.points) {
    const Vector3d position = tree.points()[point].cast<double>();
    const Surface surface = surface_at(tree, position);
    if (surface.near.empty()) continue;
    const std::array<Vector3d, 3> ends = {position,
                                          position_beside(tree, point, surface, 0),
                                          position_beside(tree, point, surface, 1)};
    for (const Vector3d& end : ends) {
      ++seen.supported;
      const Vector3d to = end - origin;
      const double range = to.norm();
      const Vector3d direction = to / range;
      const double free = range - own_length(surface, direction, range, spacing);
      if (hides(tree, spacing, origin, direction, free)) continue;
      seen.rays.push_back({{origin, direction.cast<float>()}, static_cast<float>(range)});
    }
  }
  return seen;
}

}  // namespace

bool is_left_out(std::size_t point) {
  return scatter64(static_cast<std::uint64_t>(point) + 1) % kLeaveOut == 0;
}

std::vector<LeftOutRay> rays_to_left_out(std::span<const Vector3f> points,
                                         const Vector3d& origin_world,
                                         double spacing,
                                         const Executor& executor) {
  require_argument(spacing > 0.0, "rays_to_left_out: a spacing above 0 is wanted");
  if (points.size() < kSupportPoints) return {};
  const FloatTree tree({points.begin(), points.end()});
  const std::vector<Vector3d> positions = candidates_in(tree);
  std::vector<SeenFrom> seen(positions.size());
  executor.parallel_for(positions.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) seen[i] = seen_from(tree, spacing, positions[i]);
  });
  std::erase_if(seen, [](const SeenFrom& one) { return one.supported < kFewestRays; });
  std::ranges::stable_sort(seen, std::greater{}, &SeenFrom::seen);
  seen.resize((seen.size() + 1) / 2);
  std::erase_if(seen, [most = seen.empty() ? 0.0 : seen.front().seen()](const SeenFrom& one) {
    return one.seen() < kLeastSeen * most;
  });
  std::vector<LeftOutRay> rays;
  for (const SeenFrom& one : seen) {
    rays.insert(rays.end(), one.rays.begin(), one.rays.end());
  }
  for (LeftOutRay& ray : rays) ray.ray.origin_world += origin_world;
  return rays;
}

}  // namespace pointflight
