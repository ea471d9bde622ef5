#include "pointflight/map/edit/internal/surfel_gathering.hpp"

#include <fmt/format.h>

#include <vector>

namespace pointflight {
namespace {

constexpr SurfelWord kPlaceBits = (SurfelWord{1} << 30) - 1;

bool before(const BuildSurfel& a, const BuildSurfel& b) {
  return a.morton != b.morton ? a.morton < b.morton : a.word < b.word;
}

/// A surfel of which something is said.
struct NotedSurfel {
  BuildSurfel surfel;
  SurfelNote note;
};

/// A note for each word of a tree whose voxel (0, 0, 0) is `base` of those that `noted` lie in.
std::vector<SurfelNote> notes_of(std::span<const SurfelWord> words,
                                 const std::array<std::int32_t, 3>& base,
                                 std::vector<NotedSurfel> noted) {
  if (noted.empty()) return {};
  std::ranges::stable_sort(noted, before, &NotedSurfel::surfel);
  std::vector<SurfelNote> notes(words.size());
  for_each_surfel(words, [&](const LeafHeader& leaf, std::size_t at) {
    PlacedSurfel placed = placed_surfel(leaf, words[at]);
    for (std::size_t axis = 0; axis < 3; ++axis) placed.voxel[axis] += base[axis];
    const BuildSurfel surfel{voxel_key(placed.voxel), placed.word};
    const auto found = std::ranges::lower_bound(noted, surfel, before, &NotedSurfel::surfel);
    if (found != noted.end() && !before(surfel, found->surfel)) notes[at] = found->note;
  });
  return notes;
}

}  // namespace

PlacedSurfel placed_surfel(const LeafHeader& leaf, SurfelWord word) {
  const std::array<std::uint32_t, 3> corner = {leaf.x, leaf.y, leaf.z};
  PlacedSurfel placed{{}, word & ~kPlaceBits};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto steps = static_cast<std::uint32_t>(word >> (10 * axis)) & 1023u;
    placed.voxel[axis] = static_cast<std::int32_t>(corner[axis] + (steps >> 6));
    placed.word |= static_cast<SurfelWord>(steps & 63u) << (10 * axis);
  }
  return placed;
}

SurfelMarks marks_of(const SurfelMap& map, std::size_t word) {
  return {map.has_intensity() ? map.intensity_codes()[word] : std::uint8_t{0},
          map.notes().of(static_cast<std::uint32_t>(word))};
}

EditedMap SurfelGathering::build(const MapDescription& description,
                                 bool keeps_base,
                                 const std::string& name,
                                 const Executor& executor) {
  if (count_ == 0) throw InputError(fmt::format("{}: nothing is left of it", name));
  std::array<std::int32_t, 3> base{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!keeps_base) base[axis] = min_[axis];
    if (max_[axis] - base[axis] < (1 << 20)) continue;
    throw InputError(fmt::format("{}: wider than {:.0f} km, too wide for a resolution of {:.4g} m",
                                 name,
                                 resolution_ * 1048.576,
                                 resolution_));
  }
  const auto entries = entries_.span().first(count_);
  std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.surfel.morton < b.surfel.morton;
  });
  // a leaf has room for eight at one place
  const auto crowd =
      std::unique(entries.begin(), entries.end(), [n = 1](const Entry& a, const Entry& b) mutable {
        n = a.surfel.morton == b.surfel.morton ? n + 1 : 1;
        return n > 8;
      });
  return finish(description, static_cast<std::size_t>(crowd - entries.begin()), base, executor);
}

EditedMap SurfelGathering::finish(const MapDescription& description,
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
  std::vector<NotedSurfel> noted;
  for (std::size_t i = 0; i < count; ++i) {
    surfels[i] = entries_[i].surfel;
    if (description.has_intensity) intensity[i] = entries_[i].marks.intensity;
    const SurfelNote& note = entries_[i].marks.note;
    if (!note.is_plain()) noted.push_back({entries_[i].surfel, note});
  }
  edited.description.bounds_world = bounds_of(surfels.span(), base_, resolution_);
  TreeInput input{surfels, intensity, {}, resolution_};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    input.low[axis] = static_cast<std::uint32_t>(base[axis] + kMaxVoxel);
  }
  edited.tree = build_bvh8(input, options_.quality, executor, scratch_);
  set_notes(edited.description, notes_of(edited.tree.words.span(), base, std::move(noted)));
  return edited;
}

}  // namespace pointflight
