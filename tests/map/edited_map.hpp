// Edited maps as they are written and read again.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "pointflight/map/edit/map_edit.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/map/surfel_notes.hpp"

namespace pointflight::testing {

inline std::shared_ptr<const SurfelMap> opened(const EditedMap& edited) {
  auto map = SurfelMap::from_bytes(map_bytes(edited.tree, edited.description), "edited");
  map->verify();
  return map;
}

/// The same map, whose surfels say what `note_of` has for their positions.
inline EditedMap noted(const SurfelMap& map,
                       const std::function<SurfelNote(const Vector3d& p_world)>& note_of) {
  EditedMap noted = crop_map(
      map, [](const Vector3d&) { return true; }, {}, Executor(1));
  const auto same = opened(noted);
  std::vector<SurfelNote> notes(same->words().size());
  same->for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t word) {
    notes.at(word) = note_of(p);
  });
  set_notes(noted.description, notes);
  return noted;
}

}  // namespace pointflight::testing
