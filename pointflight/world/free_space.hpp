#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/map/surfel_map.hpp"

namespace pointflight {

/// What a tour must keep to.
struct TourOptions {
  double radius = 0.3;            ///< Of the vehicle, m.
  double margin = 0.4;            ///< Kept free beyond it, m.
  double length_min = 60.0;       ///< m
  std::optional<Vector3d> start;  ///< Else one is found.
  std::optional<Aabb> bounds;     ///< Where to look, world, m; else all of the map.
  /// What else a position (world, m) has to be; null: nothing.
  std::function<bool(const Vector3d& p_world)> accepts;
};

/// A way through free space: straight legs that a vehicle can fly.
struct Tour {
  std::vector<Vector3d> points_world;  ///< The start first.
  double length = 0.0;                 ///< m
  bool has_ground = true;              ///< Below all of it; false: the map has none there.
};

/// Finds a start and waypoints inside a map: free of it by radius + margin, above ground and
/// surrounded by it (not outside the walls of a scanned hall); if there is no way above ground, at
/// any height. Long legs first; as long as `length_min` if the map allows. Nothing if no free
/// position is found. Deterministic.
std::optional<Tour> find_tour(const SurfelMap& map,
                              const TourOptions& options,
                              const Executor& executor);

/// A position for a vehicle of `radius` (m), free of the map by half a metre or as much as there is
/// room for, with ground below if there is any; the nearest one to `near_world` within the
/// resolution of the search. Nothing if none is found. Deterministic.
std::optional<Vector3d> nearest_free_position(const SurfelMap& map,
                                              const Vector3d& near_world,
                                              double radius,
                                              const Executor& executor);

}  // namespace pointflight
