// What an exact scene knows of the surfels of its map.
#pragma once

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/map/bvh8.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/scenes/exact_scene.hpp"

namespace pointflight {

/// Writes into a map's description what each surfel is a part of (the shape nearest to its centre
/// along its axes), and how much of a beam it sends back: panes and water by their class; of
/// leaves, nets, wires (`SceneClass::is_thin`) the share of rays through the surfel that hit
/// something exact. Nothing of a surfel that no shape is near. The same for any number of threads.
void note_surfaces(const ExactScene& scene,
                   const Bvh8& tree,
                   MapDescription& description,
                   const Executor& executor,
                   const Progress& progress = {});

}  // namespace pointflight
