// Edited maps as they are written and read again.
#pragma once

#include <memory>

#include "pointflight/map/edit/map_edit.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/map/surfel_map.hpp"

namespace pointflight::testing {

inline std::shared_ptr<const SurfelMap> opened(const EditedMap& edited) {
  auto map = SurfelMap::from_bytes(map_bytes(edited.tree, edited.description), "edited");
  map->verify();
  return map;
}

}  // namespace pointflight::testing
