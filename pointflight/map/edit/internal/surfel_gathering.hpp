#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/internal/morton.hpp"
#include "pointflight/map/edit/map_edit.hpp"
#include "pointflight/map/internal/voxel_moments.hpp"

namespace pointflight {

/// What is known of a surfel beside its shape.
struct SurfelMarks {
  std::uint8_t intensity = 0;  ///< Its code.
  SurfelNote note{};           ///< `SurfelMap::notes`
};
/// Of a map's surfel.
SurfelMarks marks_of(const SurfelMap& map, std::size_t word);

/// A surfel by the voxel that it lies in.
struct PlacedSurfel {
  std::array<std::int32_t, 3> voxel;  ///< From the map's origin.
  SurfelWord word;                    ///< Its centre from the voxel's low corner.
};
/// The same surfel, bit for bit.
PlacedSurfel placed_surfel(const LeafHeader& leaf, SurfelWord word);

/// Surfels on their way into a new map, in voxels of its lattice.
class SurfelGathering {
 public:
  /// `base_world`: corner of voxel (0, 0, 0) of the lattice.
  SurfelGathering(const Vector3d& base_world,
                  double resolution,
                  std::size_t most_surfels,
                  const EditOptions& options)
      : base_(base_world),
        resolution_(resolution),
        options_(options),
        scratch_(options.scratch_folder, options.scratch_memory),
        entries_(scratch_, most_surfels) {}

  /// A surfel of a map whose voxel (0, 0, 0) is that of the lattice: not a bit changes.
  void add_as_is(const LeafHeader& leaf, SurfelWord word, const SurfelMarks& marks) {
    const PlacedSurfel placed = placed_surfel(leaf, word);
    append(placed.voxel, placed.word, marks);
  }

  /// A surfel anywhere; false if it lies too far from the lattice's base.
  bool add(const Vector3d& center_world, Surfel surfel, const SurfelMarks& marks) {
    std::array<std::int32_t, 3> voxel{};
    for (int axis = 0; axis < 3; ++axis) {
      const double at = (center_world[axis] - base_[axis]) / resolution_;
      if (!(std::abs(at) < static_cast<double>(kMaxVoxel))) return false;
      const double low = std::floor(at);
      voxel[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(low);
      surfel.center_voxels[axis] = std::clamp(static_cast<float>(at - low), 0.0f, 0.999f);
    }
    append(voxel, encode(surfel), marks);
    return true;
  }

  [[nodiscard]] std::size_t count() const { return count_; }

  /// `keeps_base`: the new map's voxel (0, 0, 0) is the lattice's; else it is where the surfels
  /// begin.
  EditedMap build(const MapDescription& description,
                  bool keeps_base,
                  const std::string& name,
                  const Executor& executor);

 private:
  struct Entry {
    BuildSurfel surfel;
    SurfelMarks marks;
  };

  void append(const std::array<std::int32_t, 3>& voxel, SurfelWord word, const SurfelMarks& marks) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      min_[axis] = std::min(min_[axis], voxel[axis]);
      max_[axis] = std::max(max_[axis], voxel[axis]);
    }
    entries_[count_++] = {{voxel_key(voxel), word}, marks};
  }

  EditedMap finish(const MapDescription& description,
                   std::size_t count,
                   const std::array<std::int32_t, 3>& base,
                   const Executor& executor);

  Vector3d base_;
  double resolution_;
  const EditOptions& options_;
  Scratch scratch_;
  ScratchArray<Entry> entries_;
  std::size_t count_ = 0;
  std::array<std::int32_t, 3> min_{kMaxVoxel, kMaxVoxel, kMaxVoxel};
  std::array<std::int32_t, 3> max_{-kMaxVoxel, -kMaxVoxel, -kMaxVoxel};
};

}  // namespace pointflight
