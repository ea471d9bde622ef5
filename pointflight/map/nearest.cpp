#include <cmath>

#include "pointflight/map/internal/nearest_kernel.hpp"
#include "pointflight/map/surfel_map.hpp"

namespace pointflight {

std::optional<Nearest> SurfelMap::nearest(const Vector3d& point_world, double max_distance) const {
  if (!point_world.allFinite() || !(max_distance >= 0.0)) return std::nullopt;
  const NearestWord found = find_nearest(
      nodes_, words_, scale_, resolution(), point_world - origin_world(), max_distance);
  if (found.word == 0) return std::nullopt;
  const LeafHeader leaf = decode_leaf(words_[found.leaf]);
  const Vector3d center = center_world(leaf, words_[found.word]);
  return Nearest{std::sqrt(static_cast<double>(found.squared_distance)), center, found.word};
}

}  // namespace pointflight
