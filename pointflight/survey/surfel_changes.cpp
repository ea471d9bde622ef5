#include "pointflight/survey/surfel_changes.hpp"

#include "pointflight/map/edit/internal/surfel_gathering.hpp"

namespace pointflight {

EditedMap changed(const SurfelMap& map,
                  const SurfelChange& change,
                  const EditOptions& options,
                  const Executor& executor) {
  std::size_t count = 0;
  for_each_surfel(map.words(), [&](const LeafHeader&, std::size_t) { ++count; });
  SurfelGathering all(map.origin_world(), map.resolution(), count, options);
  for_each_surfel(map.words(), [&](const LeafHeader& leaf, std::size_t word) {
    const auto now = change(leaf, word);
    if (now) all.add_as_is(leaf, *now, marks_of(map, word));
  });
  return all.build(description_of(map), true, "the map", executor);
}

}  // namespace pointflight
