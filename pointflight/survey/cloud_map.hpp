// A map made of clouds without scans, at the resolution that suits them.
#pragma once

#include <vector>

#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/survey/resolution_search.hpp"

namespace pointflight {

/// A finished map of clouds.
struct CloudMap {
  ImportedMap map;  ///< Of all points.
  /// In ascending order; empty if one was given, or nothing could judge.
  std::vector<TriedResolution> tried;
};

/// Tries resolutions: maps of nineteen points in twenty, judged by rays to the others
/// (`rays_to_left_out`), each right if it is rendered within 0.1 m of them. From twice the spacing
/// on by `search_resolutions`, then halfway on both sides of the best. Of clouds with more than
/// `most_points`, four places at most that hold as many together. Empty if fewer than 2000 rays can
/// judge. Throws InputError.
std::vector<TriedResolution> try_resolutions(const std::vector<CloudSource>& clouds,
                                             const ImportOptions& options,
                                             const Executor& executor,
                                             const Progress& progress = {},
                                             std::size_t most_points = 2'000'000);

/// `import_clouds`; without a resolution in `options` the best by those that were tried
/// (`peak_resolution`), if anything could judge them and no source is a mesh.
CloudMap map_clouds(const std::vector<CloudSource>& sources,
                    const ImportOptions& options,
                    const Executor& executor,
                    const Progress& progress = {});

}  // namespace pointflight
