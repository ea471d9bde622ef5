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

/// Surfels on their way into a new map, in voxels of its lattice.
class SurfelGathering {
  static constexpr SurfelWord kPlaceBits = (SurfelWord{1} << 30) - 1;

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
  void add_as_is(const LeafHeader& leaf, SurfelWord word, std::uint8_t intensity) {
    const std::array<std::uint32_t, 3> corner = {leaf.x, leaf.y, leaf.z};
    std::array<std::int32_t, 3> voxel{};
    SurfelWord place = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto steps = static_cast<std::uint32_t>(word >> (10 * axis)) & 1023u;
      voxel[axis] = static_cast<std::int32_t>(corner[axis] + (steps >> 6));
      place |= static_cast<SurfelWord>(steps & 63u) << (10 * axis);
    }
    append(voxel, (word & ~kPlaceBits) | place, intensity);
  }

  /// A surfel anywhere; false if it lies too far from the lattice's base.
  bool add(const Vector3d& center_world, Surfel surfel, std::uint8_t intensity) {
    std::array<std::int32_t, 3> voxel{};
    for (int axis = 0; axis < 3; ++axis) {
      const double at = (center_world[axis] - base_[axis]) / resolution_;
      if (!(std::abs(at) < static_cast<double>(kMaxVoxel))) return false;
      const double low = std::floor(at);
      voxel[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(low);
      surfel.center_voxels[axis] = std::clamp(static_cast<float>(at - low), 0.0f, 0.999f);
    }
    append(voxel, encode(surfel), intensity);
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
    std::uint8_t intensity = 0;
  };

  void append(const std::array<std::int32_t, 3>& voxel, SurfelWord word, std::uint8_t intensity) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      min_[axis] = std::min(min_[axis], voxel[axis]);
      max_[axis] = std::max(max_[axis], voxel[axis]);
    }
    entries_[count_++] = {{voxel_key(voxel), word}, intensity};
  }

  EditedMap finish(const MapDescription& description,
                   std::size_t count,
                   const std::array<std::int32_t, 3>& base,
                   const Executor& executor) {
    EditedMap edited;
    edited.description = description;
    edited.description.origin_world = base_ + resolution_ * Vector3d(base[0], base[1], base[2]);
    edited.description.surfel_count = count;
    edited.surfels = count;
    ScratchArray<BuildSurfel> surfels(scratch_, count);
    ScratchArray<std::uint8_t> intensity(scratch_, description.has_intensity ? count : 0);
    for (std::size_t i = 0; i < count; ++i) {
      surfels[i] = entries_[i].surfel;
      if (description.has_intensity) intensity[i] = entries_[i].intensity;
    }
    edited.description.bounds_world = bounds_of(surfels.span(), base_, resolution_);
    TreeInput input{surfels, intensity, {}, resolution_};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      input.low[axis] = static_cast<std::uint32_t>(base[axis] + kMaxVoxel);
    }
    edited.tree = build_bvh8(input, options_.quality, executor, scratch_);
    return edited;
  }

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
