#pragma once

#include <algorithm>
#include <memory>
#include <nanoflann.hpp>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Many points, found by what they are near to: nanoflann's tree.
template <class Point>
class PointTree {
 public:
  /// A point within a radius.
  struct Near {
    std::uint32_t index;  ///< In `points`.
    double squared;       ///< Distance, m^2.
  };

  explicit PointTree(std::vector<Point> points)
      : adaptor_(std::make_unique<Adaptor>(Adaptor{std::move(points)})),
        index_(std::make_unique<Index>(
            3, *adaptor_, nanoflann::KDTreeSingleIndexAdaptorParams(kLeafPoints))) {}

  [[nodiscard]] const std::vector<Point>& points() const { return adaptor_->points; }

  /// True if at least `count` points are nearer to a position than `radius` (m).
  [[nodiscard]] bool has_within(const Vector3d& position, double radius, std::size_t count) const {
    EnoughPoints result{radius * radius, count};
    index_->findNeighbors(result, position.data(), {});
    return result.found >= count;
  }

  /// Those nearer to a position than `radius` (m), the nearest first.
  [[nodiscard]] std::vector<Near> within(const Vector3d& position, double radius) const {
    PointsWithin result{radius * radius, {}};
    index_->findNeighbors(result, position.data(), {});
    std::ranges::sort(result.items, {}, &Near::squared);
    return std::move(result.items);
  }

  /// Squared distance of a point of the tree to the nearest other one, m^2; there are two or more.
  [[nodiscard]] double squared_spacing(std::size_t i) const {
    const Vector3d position = adaptor_->points[i].template cast<double>();
    std::uint32_t index[2];
    double squared[2];
    index_->knnSearch(position.data(), 2, index, squared);
    return squared[1];
  }

 private:
  static constexpr std::size_t kLeafPoints = 16;

  // NOLINTBEGIN(readability-identifier-naming): nanoflann asks for these names
  struct Adaptor {
    std::vector<Point> points;
    [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
    [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
      return static_cast<double>(points[i][static_cast<int>(axis)]);
    }
    template <class Bounds>
    bool kdtree_get_bbox(Bounds& /*box*/) const {
      return false;
    }
  };
  /// Stops once enough points are found.
  struct EnoughPoints {
    using DistanceType = double;
    double squared = 0.0;
    std::size_t wanted = 0;
    std::size_t found = 0;
    [[nodiscard]] bool addPoint(double distance, std::uint32_t /*index*/) {
      found += distance < squared ? 1 : 0;
      return found < wanted;
    }
    [[nodiscard]] double worstDist() const { return squared; }
    [[nodiscard]] bool full() const { return true; }
    [[nodiscard]] std::size_t size() const { return found; }
    void sort() {}
  };
  /// All within a radius. (nanoflann's own result holds pairs up to version 1.4 and a type of its
  /// own from 1.5 on.)
  struct PointsWithin {
    using DistanceType = double;
    double squared = 0.0;
    std::vector<Near> items;
    bool addPoint(double distance, std::uint32_t index) {
      if (distance < squared) items.push_back({index, distance});
      return true;
    }
    [[nodiscard]] double worstDist() const { return squared; }
    [[nodiscard]] bool full() const { return true; }
    [[nodiscard]] std::size_t size() const { return items.size(); }
    void sort() {}
  };
  // NOLINTEND(readability-identifier-naming)
  using Index = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Adaptor>,
                                                    Adaptor,
                                                    3,
                                                    std::uint32_t>;

  std::unique_ptr<const Adaptor> adaptor_;  ///< Where it is, whoever moves the tree.
  std::unique_ptr<Index> index_;
};

}  // namespace pointflight
