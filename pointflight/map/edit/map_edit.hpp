#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/map/surfel_map.hpp"

namespace pointflight {

/// A map edited surfel by surfel. Surfels that are not moved stay identical to the bit; a rotation
/// rounds their centres again to r / 64 and their axes to 0.3 degrees.
struct EditedMap {
  Bvh8 tree;                         ///< For `write_map`.
  MapDescription description;        ///< For `write_map`.
  std::uint64_t surfels_before = 0;  ///< Of all maps together.
  std::uint64_t surfels = 0;         ///< That are left.
  std::uint64_t doubles = 0;         ///< Dropped by `merge_maps`: an earlier map covers the cell.
};

/// How an edit is done.
struct EditOptions {
  TreeQuality quality = TreeQuality::kHigh;  ///< Of the hierarchy, which is built anew.
  /// For what does not fit into memory; empty: with temporary files.
  std::string scratch_folder = {};
  std::size_t scratch_memory = Scratch::kDefaultMemory;  ///< Bytes.
  std::string note = {};  ///< What was done, appended to the metadata's list "edited".
};

/// What `write_map` needs to write the same map again; of further sections the known space and what
/// intensities stand for, not the marks of surfels, which go with the tree.
MapDescription description_of(const SurfelMap& map);

/// Appends what was done to the metadata's list "edited".
void append_note(EditedMap& edited, const std::string& note);

/// Keeps the surfels whose centre in the world `keep` accepts; it is called from one thread. Space
/// that held what goes is not known any more. Throws InputError if none is left.
EditedMap crop_map(const SurfelMap& map,
                   const std::function<bool(const Vector3d& center_world)>& keep,
                   const EditOptions& options,
                   const Executor& executor);

/// Moves a map: p_new = T_new_old * p_old. A mere shift changes no surfel.
EditedMap transform_map(const SurfelMap& map,
                        const Pose& T_new_old,
                        const EditOptions& options,
                        const Executor& executor);

/// A map and where it lies among others.
struct PlacedMap {
  std::shared_ptr<const SurfelMap> map;  ///< Not null.
  Pose T_world_map;                      ///< Of the joined map's frame.
};

/// Joins maps of one resolution. A surfel of a later one that lies within the cell of an earlier
/// one's is left out: twice the coverage would make edges fat. Space is known where one of them
/// knows it, if all say what they know. Intensities keep their reflectivity if all have one scale.
/// Throws InputError if resolutions differ or the whole is too wide.
EditedMap merge_maps(const std::vector<PlacedMap>& maps,
                     const EditOptions& options,
                     const Executor& executor,
                     const Progress& progress = {});

/// Calls `visit` with the surfels of `map` whose boxes lie farther than `distance` (m) from all of
/// `other`, in order: their centre and how far they are, at most `reach` (m). Returns how many
/// surfels the map has.
std::uint64_t for_each_missing(
    const SurfelMap& map,
    const SurfelMap& other,
    double distance,
    double reach,
    const Executor& executor,
    const std::function<void(const Vector3d& center_world, double distance)>& visit,
    const Progress& progress = {});

}  // namespace pointflight
