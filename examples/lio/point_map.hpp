// The map of the odometry: points in a hash of voxels, and planes through the nearest of them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace lio {

using pointflight::Vector3d;

/// A plane normal . x = offset, normal of unit length.
struct Plane {
  Vector3d normal;
  double offset;  ///< m
};

/// Points of the world, no two much closer than `kSpacing`.
class PointMap {
 public:
  static constexpr double kVoxel = 0.5;     ///< m
  static constexpr double kSpacing = 0.12;  ///< m
  static constexpr std::size_t kNearest = 5;

  /// Adds a point, unless one is near.
  void add(const Vector3d& point);

  /// The plane through the five points nearest to `point`, if there are five within a voxel's width
  /// and a bit, and all of them lie within 0.1 m of it.
  [[nodiscard]] std::optional<Plane> plane_at(const Vector3d& point) const;

  /// How many points there are.
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  using Key = std::array<std::int32_t, 3>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      std::size_t hash = 0;
      for (const std::int32_t k : key) {
        hash = (hash ^ static_cast<std::uint32_t>(k)) * 0x9e3779b97f4a7c15ULL;
        hash ^= hash >> 29;
      }
      return hash;
    }
  };
  static Key key_of(const Vector3d& point);

  std::unordered_map<Key, std::vector<Vector3d>, Hash> voxels_;
  std::size_t size_ = 0;
};

}  // namespace lio
