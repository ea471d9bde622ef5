#pragma once

#include <cstddef>
#include <functional>
#include <optional>

#include "pointflight/map/edit/map_edit.hpp"

namespace pointflight {

/// What a surfel, the word at an index in a leaf, becomes in its place; nothing removes it.
using SurfelChange =
    std::function<std::optional<SurfelWord>(const LeafHeader& leaf, std::size_t word)>;

/// The map with each of its surfels changed.
EditedMap changed(const SurfelMap& map,
                  const SurfelChange& change,
                  const EditOptions& options,
                  const Executor& executor);

}  // namespace pointflight
