#include "pointflight/map/edit/map_edit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/internal/morton.hpp"
#include "pointflight/map/edit/internal/surfel_gathering.hpp"
#include "pointflight/map/fitted_scans.hpp"
#include "pointflight/map/internal/near_surfels.hpp"
#include "pointflight/map/internal/voxel_moments.hpp"

namespace pointflight {
namespace {

/// The header may promise anything; this counts.
std::size_t count_surfels(const SurfelMap& map) {
  std::size_t count = 0;
  for_each_surfel(map.words(), [&](const LeafHeader&, std::size_t) { ++count; });
  return count;
}

Surfel turned(Surfel surfel, const Quaterniond& rotation) {
  surfel.axes = (rotation.toRotationMatrix() * surfel.axes.cast<double>()).cast<float>();
  return surfel;
}

/// True if a surfel of `map` that was seen stands for the position already: its cell, turned as it
/// is, holds it.
bool covers(const SurfelMap& map, const Vector3d& p_map) {
  const double r = map.resolution();
  const Vector3d half(0.5 * r, 0.6 * r, 0.6 * r);  // centroids lie anywhere in their cells
  bool found = false;
  const double reach = half.norm();
  visit_near(map, {p_map, p_map}, reach, [&](const SurfelBox& box) {
    const Vector3d p_box = box.T_world_box.inverse() * p_map;
    const bool is_inside = (p_box.cwiseAbs().array() <= half.array()).all();
    found = found || (is_inside && !map.is_assumed(box.word));
    return found ? -1.0 : reach;
  });
  return found;
}

void check_pose(const Pose& pose) {
  const double norm = pose.rotation.norm();
  if (pose.translation.allFinite() && std::abs(norm - 1.0) < 1e-6) return;
  throw InputError("a map is moved by finite metres and a unit quaternion");
}

/// The same space where the map lies now.
void move_known_space(const SurfelMap& map, const Pose& T_new_old, MapDescription& description) {
  if (map.known_space() == nullptr) return;
  set_section(description, KnownSpace::kSection, map.known_space()->moved(T_new_old));
}

/// The tree and its words as they are.
EditedMap shifted(const SurfelMap& map, const Vector3d& by, const EditOptions& options) {
  Scratch scratch(options.scratch_folder, options.scratch_memory);
  EditedMap edited;
  const auto copy = [&](const auto& from, auto& to) {
    to = std::remove_reference_t<decltype(to)>(scratch, from.size());
    std::copy(from.begin(), from.end(), to.begin());
  };
  copy(map.nodes(), edited.tree.nodes);
  copy(map.words(), edited.tree.words);
  copy(map.intensity_codes(), edited.tree.intensity);
  edited.description = description_of(map);
  for (const char* name : {kAssumedSection, kLabelsSection, kOpacitySection}) {
    const auto notes = map.section(name);
    set_section(edited.description, name, {notes.begin(), notes.end()});
  }
  edited.description.origin_world += by;
  edited.description.bounds_world.min += by;
  edited.description.bounds_world.max += by;
  move_known_space(map, {Quaterniond::Identity(), by}, edited.description);
  edited.surfels = edited.surfels_before = count_surfels(map);
  append_note(edited, options.note);
  return edited;
}

/// What one of them knows; nothing if one does not say.
void join_known_space(const std::vector<PlacedMap>& maps, EditedMap& joined) {
  std::vector<std::byte> section;
  const bool all_say = std::all_of(maps.begin(), maps.end(), [](const PlacedMap& placed) {
    return placed.map->known_space() != nullptr;
  });
  if (all_say) {
    Aabb box;
    for (const PlacedMap& placed : maps) {
      const CellGrid& grid = placed.map->known_space()->grid();
      for (unsigned corner = 0; corner < 8; ++corner) {
        const Vector3d at(corner & 1u ? grid.size[0] : 0.0,
                          corner & 2u ? grid.size[1] : 0.0,
                          corner & 4u ? grid.size[2] : 0.0);
        box.add(placed.T_world_map * (grid.T_world_grid * (grid.cell * at)));
      }
    }
    KnownSpaceBuilder known(box, joined.description.resolution, joined.surfels);
    known.add([&](const Vector3d& center) {
      return std::any_of(maps.begin(), maps.end(), [&](const PlacedMap& placed) {
        return placed.map->known_space()->known(placed.T_world_map.inverse() * center);
      });
    });
    section = known.section();
  }
  set_section(joined.description, KnownSpace::kSection, std::move(section));
}

/// One scale of intensities for several maps.
IntensityLevels join_intensities(const std::vector<PlacedMap>& maps, MapDescription& description) {
  const double scale = maps.front().map->reflectivity_per_intensity();
  const bool is_shared = std::all_of(maps.begin(), maps.end(), [&](const PlacedMap& placed) {
    return placed.map->reflectivity_per_intensity() == scale;
  });
  if (!is_shared) set_reflectivity(description, 0.0);
  IntensityLevels levels = maps.front().map->intensity_levels();
  const bool is_one = std::all_of(maps.begin(), maps.end(), [&](const PlacedMap& placed) {
    return placed.map->has_intensity() && placed.map->intensity_levels().of_code == levels.of_code;
  });
  description.has_intensity = is_one;
  if (is_one) return levels;
  IntensityHistogram intensities;
  for (const PlacedMap& placed : maps) {
    if (!placed.map->has_intensity()) continue;
    for_each_surfel(placed.map->words(), [&](const LeafHeader&, std::size_t word) {
      intensities.add(placed.map->intensity(static_cast<std::uint32_t>(word)));
    });
  }
  description.has_intensity = !intensities.is_empty();
  levels = intensities.levels();
  set_levels(description, levels);
  return levels;
}

/// Labels of several maps side by side: things get numbers of their own. If the maps' classes have
/// other names, or there are more things than numbers, none is kept.
class JoinedLabels {
 public:
  JoinedLabels(const std::vector<PlacedMap>& maps, MapDescription& description) {
    for (const PlacedMap& placed : maps) {
      const SurfelNotes& notes = placed.map->notes();
      first_.push_back(next_);
      if (!notes.has_labels()) continue;
      are_kept_ = are_kept_ && (names_.empty() || names_ == notes.class_names());
      names_ = notes.class_names();
      std::uint32_t most = 0;
      for_each_surfel(placed.map->words(), [&](const LeafHeader&, std::size_t word) {
        most = std::max(most, notes.label(static_cast<std::uint32_t>(word)).thing);
      });
      next_ += most + 1;
      are_kept_ = are_kept_ && next_ <= SurfelLabel::kThings;
    }
    set_class_names(description, are_kept_ ? names_ : std::vector<std::string>{});
  }

  /// Of a surfel of map number `m`.
  [[nodiscard]] SurfelLabel of(std::size_t m, const SurfelLabel& label) const {
    if (!are_kept_ || label == SurfelLabel{}) return {};
    return {label.kind, label.thing + first_[m]};
  }

 private:
  std::vector<std::string> names_;
  std::vector<std::uint32_t> first_;  // number of each map's thing 0
  std::uint32_t next_ = 0;
  bool are_kept_ = true;
};

[[noreturn]] void refuse_width(double resolution) {
  throw InputError(
      fmt::format("the maps lie more than {:.0f} km apart, too far for a resolution of {:.4g} m",
                  resolution * 1048.576,
                  resolution));
}

}  // namespace

MapDescription description_of(const SurfelMap& map) {
  MapDescription d;
  static_cast<MapProperties&>(d) = map.properties();
  d.has_intensity = map.has_intensity();
  d.metadata = std::string(map.metadata());
  for (const char* name : {KnownSpace::kSection,
                           kReflectivitySection,
                           kLevelsSection,
                           kClassesSection,
                           kFittedSection}) {
    const auto bytes = map.section(name);
    if (!bytes.empty()) d.extra.push_back({name, {bytes.begin(), bytes.end()}});
  }
  return d;
}

void append_note(EditedMap& edited, const std::string& note) {
  auto json = nlohmann::ordered_json::parse(edited.description.metadata, nullptr, false);
  if (!json.is_object()) json = nlohmann::ordered_json::object();
  if (!json.contains("edited") || !json["edited"].is_array()) {
    json["edited"] = nlohmann::ordered_json::array();
  }
  json["edited"].push_back(note);
  json["surfels"] = edited.surfels;
  if (json.contains("has_intensity")) json["has_intensity"] = edited.description.has_intensity;
  json.erase("planar_surfels");  // of the import; `map info` counts
  edited.description.metadata = json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace);
}

EditedMap crop_map(const SurfelMap& map,
                   const std::function<bool(const Vector3d& center_world)>& keep,
                   const EditOptions& options,
                   const Executor& executor) {
  std::vector<bool> kept;  // a bit a surfel, so that no room is taken for those that go
  std::size_t count = 0;
  for_each_surfel(map.words(), [&](const LeafHeader& leaf, std::size_t word) {
    kept.push_back(keep(map.center_world(leaf, map.words()[word])));
    count += kept.back() ? 1 : 0;
  });
  SurfelGathering gathering(map.origin_world(), map.resolution(), count, options);
  std::size_t at = 0;
  std::vector<Vector3d> gone;  // where space is not known any more
  for_each_surfel(map.words(), [&](const LeafHeader& leaf, std::size_t word) {
    if (!kept[at++]) {
      if (map.known_space() != nullptr) gone.push_back(map.center_world(leaf, map.words()[word]));
      return;
    }
    gathering.add_as_is(leaf, map.words()[word], marks_of(map, word));
  });
  EditedMap edited = gathering.build(description_of(map), true, "crop", executor);
  edited.surfels_before = kept.size();
  if (map.known_space() != nullptr) {
    set_section(edited.description, KnownSpace::kSection, map.known_space()->without(gone));
  }
  append_note(edited, options.note);
  return edited;
}

EditedMap transform_map(const SurfelMap& map,
                        const Pose& T_new_old,
                        const EditOptions& options,
                        const Executor& executor) {
  check_pose(T_new_old);
  if (T_new_old.rotation.vec().isZero(0.0)) return shifted(map, T_new_old.translation, options);
  const std::size_t count = count_surfels(map);
  // amid the surfels: far from it a lattice ends
  const Vector3d middle = 0.5 * (map.bounds_world().min + map.bounds_world().max);
  SurfelGathering gathering(T_new_old * middle, map.resolution(), count, options);
  for_each_surfel(map.words(), [&](const LeafHeader& leaf, std::size_t word) {
    const Surfel surfel = decode(map.words()[word]);
    const Vector3d center = T_new_old * map.center_world(leaf, map.words()[word]);
    if (!gathering.add(center, turned(surfel, T_new_old.rotation), marks_of(map, word))) {
      refuse_width(map.resolution());
    }
  });
  EditedMap edited = gathering.build(description_of(map), false, "transform", executor);
  move_known_space(map, T_new_old, edited.description);
  edited.surfels_before = count;
  append_note(edited, options.note);
  return edited;
}

EditedMap merge_maps(const std::vector<PlacedMap>& maps,
                     const EditOptions& options,
                     const Executor& executor,
                     const Progress& progress) {
  if (maps.empty()) throw InputError("merge: no maps are given");
  for (const PlacedMap& placed : maps) {
    if (placed.map == nullptr) throw InputError("merge: a map is null");
    check_pose(placed.T_world_map);
    const double r = maps.front().map->resolution();
    if (std::abs(placed.map->resolution() - r) < 1e-9 * r) continue;
    throw InputError(
        fmt::format("the maps have resolutions of {:.4g} m and {:.4g} m; merge their clouds and "
                    "import these, or import them again with one --resolution",
                    r,
                    placed.map->resolution()));
  }
  const SurfelMap& first = *maps.front().map;
  const Pose& T_first = maps.front().T_world_map;
  const bool first_stays = T_first.rotation.vec().isZero(0.0);
  std::size_t most = 0;
  for (const PlacedMap& placed : maps) most += count_surfels(*placed.map);
  MapDescription description = description_of(first);
  const IntensityLevels levels = join_intensities(maps, description);
  const JoinedLabels labels(maps, description);
  const Vector3d base =
      first_stays ? Vector3d(first.origin_world() + T_first.translation)
                  : T_first * (0.5 * (first.bounds_world().min + first.bounds_world().max));
  SurfelGathering gathering(base, first.resolution(), most, options);
  std::uint64_t doubles = 0;
  for (std::size_t m = 0; m < maps.size(); ++m) {
    const SurfelMap& map = *maps[m].map;
    const Pose& T = maps[m].T_world_map;
    std::size_t done = 0;
    for_each_surfel(map.words(), [&](const LeafHeader& leaf, std::size_t word) {
      if (done++ % 65536 == 0) {
        report(progress, "merging", static_cast<double>(m) / static_cast<double>(maps.size()));
      }
      SurfelMarks marks = marks_of(map, word);
      marks.note.label = labels.of(m, marks.note.label);
      if (description.has_intensity) {
        marks.intensity = levels.code_of(map.intensity(static_cast<std::uint32_t>(word)));
      }
      if (m == 0 && first_stays) {
        gathering.add_as_is(leaf, map.words()[word], marks);
        return;
      }
      const Surfel surfel = decode(map.words()[word]);
      const Vector3d center = T * map.center_world(leaf, map.words()[word]);
      const bool taken =
          std::any_of(maps.begin(),
                      maps.begin() + static_cast<std::ptrdiff_t>(m),
                      [&](const PlacedMap& earlier) {
                        return covers(*earlier.map, earlier.T_world_map.inverse() * center);
                      });
      if (taken) {
        ++doubles;
      } else if (!gathering.add(center, turned(surfel, T.rotation), marks)) {
        refuse_width(first.resolution());
      }
    });
  }
  EditedMap edited = gathering.build(description, false, "merge", executor);
  edited.surfels_before = most;
  edited.doubles = doubles;
  join_known_space(maps, edited);
  for (const PlacedMap& placed : maps) {
    add_fitted_scans(edited.description, fitted_scans(*placed.map));
  }
  append_note(edited, options.note);
  return edited;
}

std::uint64_t for_each_missing(
    const SurfelMap& map,
    const SurfelMap& other,
    double distance,
    double reach,
    const Executor& executor,
    const std::function<void(const Vector3d& center_world, double distance)>& visit,
    const Progress& progress) {
  if (!(distance >= 0.0) || !(reach >= distance)) {
    throw InputError("a difference wants a distance of 0 or more and a reach beyond it");
  }
  constexpr std::size_t kBatch = 65536;
  std::vector<Vector3d> centers;
  std::vector<double> distances;
  const auto flush = [&] {
    distances.assign(centers.size(), reach);
    executor.parallel_for(centers.size(), 1024, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const auto nearest = other.nearest(centers[i], reach);
        if (nearest) distances[i] = nearest->distance;
      }
    });
    for (std::size_t i = 0; i < centers.size(); ++i) {
      if (distances[i] > distance) visit(centers[i], distances[i]);
    }
    centers.clear();
  };
  std::uint64_t count = 0;
  const auto all = static_cast<double>(std::max<std::size_t>(1, map.words().size()));
  for_each_surfel(map.words(), [&](const LeafHeader& leaf, std::size_t word) {
    ++count;
    centers.push_back(map.center_world(leaf, map.words()[word]));
    if (centers.size() < kBatch) return;
    flush();
    report(progress, "comparing", static_cast<double>(word) / all);
  });
  flush();
  return count;
}

}  // namespace pointflight
