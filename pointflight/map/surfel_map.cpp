#include "pointflight/map/surfel_map.hpp"

#include <fmt/format.h>

#include <cmath>

#include "pointflight/core/input_error.hpp"
#include "pointflight/map/internal/nearest_kernel.hpp"

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

const KnownSpace& known_space_of(const SurfelMap& map) {
  if (map.known_space() != nullptr) return *map.known_space();
  throw InputError(
      fmt::format("{} does not say what its survey saw: make it with 'map import --scans', or fit "
                  "it with 'map fit --scans'",
                  map.name()));
}

}  // namespace pointflight
