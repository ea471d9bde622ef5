#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/geometry/types.hpp"
#include "pointflight/map/bvh8.hpp"
#include "pointflight/map/intensity_levels.hpp"
#include "pointflight/map/known_space.hpp"
#include "pointflight/map/surfel_notes.hpp"
#include "pointflight/map/surfel_scale.hpp"

namespace pointflight {

/// Constants of the measurement model, stored with every map (docs/architecture.md, "Hit rule").
struct RenderModel {
  float support = kSupport;  ///< Standard deviations.
  float tau = 0.35f;         ///< Coverage from which there is a return.
  float window = 0.5f;       ///< Depth over which coverage adds up, in units of r.
};

/// What the header of a map says.
struct MapProperties {
  double resolution = 0.0;                   ///< r, m.
  Vector3d origin_world = Vector3d::Zero();  ///< Of the corner of voxel (0, 0, 0), m.
  Aabb bounds_world;                         ///< Of the surfel centres, m.
  RenderModel model;                         ///< Constants of the hit rule that it is made for.
  float intensity_offset = 0.0f;             ///< Of byte 0, in the cloud's scale.
  float intensity_step = 0.0f;               ///< From one byte's value to the next.
  std::uint64_t surfel_count = 0;            ///< Leaf headers not counted.
};

/// A row of the table of sections in a map file (map_file.hpp).
struct MapSection {
  char name[16];           ///< "nodes", filled up with zeros.
  std::uint64_t offset;    ///< Bytes from the file's start; a multiple of kMapAlignment.
  std::uint64_t size;      ///< Bytes.
  std::uint64_t checksum;  ///< XXH3-64 of the bytes.
};
/// Its name without the zeros behind it.
inline std::string_view section_name(const MapSection& section) {
  return {section.name, strnlen(section.name, sizeof section.name)};
}

/// Name of the section that says what reflectivity an intensity stands for.
inline constexpr char kReflectivitySection[] = "reflectivity";

/// Name of the section with the scans that the map was fitted to (fitted_scans.hpp): u64[].
inline constexpr char kFittedSection[] = "fitted";

/// The nearest thing to a point.
struct Nearest {
  double distance;        ///< To the surfel's box, m; 0 inside it.
  Vector3d center_world;  ///< Of that surfel.
  std::uint32_t word;     ///< Index of the surfel in `SurfelMap::words()`.
};

/// Calls `visit(leaf, index in words)` for every surfel of a map's words.
template <class Visit>
void for_each_surfel(std::span<const SurfelWord> words, const Visit& visit) {
  for (std::size_t at = 0; at + kLeafPadding < words.size();) {
    const LeafHeader leaf = decode_leaf(words[at]);
    for (std::size_t i = 1; i <= leaf.count && at + i + kLeafPadding < words.size() + 1; ++i) {
      visit(leaf, at + i);
    }
    at += leaf.count + 1;
  }
}

/// An opened `.pfmap`: immutable, mapped read-only, shared between processes by the page cache.
///
/// The same hierarchy answers rays (render/) and distances. A corrupt body can give wrong answers
/// but never a read outside the file or an endless loop: every offset is bounded at use.
class SurfelMap {
 public:
  /// Opens in milliseconds: header, section table and lengths are checked, the body is not read.
  /// Throws InputError if the file is not a map of a supported version (1 or 2).
  static std::shared_ptr<const SurfelMap> open(const std::string& path);

  /// Bytes of a whole file; `name` stands for the path in messages.
  static std::shared_ptr<const SurfelMap> from_bytes(std::span<const std::byte> bytes,
                                                     const std::string& name);

  virtual ~SurfelMap() = default;

  /// As its header says; what follows are its parts.
  [[nodiscard]] const MapProperties& properties() const { return properties_; }
  /// As `MapProperties`.
  ///@{
  [[nodiscard]] double resolution() const { return properties_.resolution; }
  [[nodiscard]] const Vector3d& origin_world() const { return properties_.origin_world; }
  [[nodiscard]] const Aabb& bounds_world() const { return properties_.bounds_world; }
  [[nodiscard]] const RenderModel& model() const { return properties_.model; }
  [[nodiscard]] std::uint64_t surfel_count() const { return properties_.surfel_count; }
  ///@}
  /// The constants that its surfels are decoded with.
  [[nodiscard]] const SurfelScale& scale() const { return scale_; }
  /// As it was opened, for messages.
  [[nodiscard]] const std::string& name() const { return name_; }
  /// Bytes.
  [[nodiscard]] std::uint64_t file_size() const { return file_size_; }

  /// Sixteen hexadecimal digits of what is in the map, its metadata left out. Read from the header:
  /// it costs nothing.
  [[nodiscard]] std::string hash() const;

  /// A section of the file by its name, empty without one: for what this class does not know.
  [[nodiscard]] std::span<const std::byte> section(std::string_view name) const;

  /// What space the survey saw that the map was fitted to; null if the file does not say.
  [[nodiscard]] const KnownSpace* known_space() const { return known_ ? &*known_ : nullptr; }

  /// Reflectivity of its surfaces per unit of intensity; 0 if it does not say.
  [[nodiscard]] double reflectivity_per_intensity() const { return reflectivity_; }

  /// How the map was made, as JSON text.
  [[nodiscard]] std::string_view metadata() const { return metadata_; }

  /// The hierarchy's inner nodes, the root first; empty for an empty map.
  [[nodiscard]] std::span<const Bvh8Node> nodes() const { return nodes_; }
  /// Leaf headers, each with its surfels behind it, and kLeafPadding words.
  [[nodiscard]] std::span<const SurfelWord> words() const { return words_; }
  /// False: `intensity` is 0 everywhere.
  [[nodiscard]] bool has_intensity() const { return !intensity_.empty(); }

  /// Centre of a surfel of that leaf, m.
  [[nodiscard]] Vector3d center_world(const LeafHeader& leaf, SurfelWord word) const {
    return origin_world() +
           resolution() * (Vector3d(leaf.x, leaf.y, leaf.z) + center_voxels(word).cast<double>());
  }

  /// What it says of surfels beside shape and intensity.
  [[nodiscard]] const SurfelNotes& notes() const { return notes_; }
  /// True if some surfels are marked as assumed.
  [[nodiscard]] bool has_assumed() const { return notes_.has_assumed(); }
  /// True of a surfel that no survey saw: it closes a hole in a plane that was seen around it.
  /// False of `kNoSurfel` and whatever else is no index.
  [[nodiscard]] bool is_assumed(std::uint32_t word) const { return notes_.is_assumed(word); }

  /// What the codes of intensities stand for.
  [[nodiscard]] const IntensityLevels& intensity_levels() const { return levels_; }
  /// Codes of the intensities beside `words`, empty without.
  [[nodiscard]] std::span<const std::uint8_t> intensity_codes() const { return intensity_; }

  /// Intensity of the surfel at a word index, in the cloud's own scale; 0 without intensities.
  [[nodiscard]] float intensity(std::uint32_t word) const {
    return word < intensity_.size() ? levels_.of_code[intensity_[word]] : 0.0f;
  }

  /// The nearest surfel within `max_distance` of a point: distance to its oriented box with half
  /// sides sqrt(3) s_k (r / 2 for a filled cell). Nothing if all are farther, or if the point
  /// or the distance is NaN.
  [[nodiscard]] std::optional<Nearest> nearest(const Vector3d& point_world,
                                               double max_distance) const;

  /// Reads the whole file: checksums and structure. Throws InputError that names the section.
  void verify() const;

  /// Calls `visit(center_world, normal_world, thickness_m, word_index)` for every surfel.
  template <class Visit>
  void for_each_surfel(const Visit& visit) const {
    pointflight::for_each_surfel(words_, [&](const LeafHeader& leaf, std::size_t word) {
      const Surfel surfel = decode(words_[word]);
      const Vector3d center = center_world(leaf, words_[word]);
      const Vector3d normal = surfel.axes.col(0).cast<double>();
      visit(center, normal, surfel.s[0] * resolution(), static_cast<std::uint32_t>(word));
    });
  }

 protected:
  SurfelMap() = default;
  /// Points the views into `bytes`, which must outlive the map. Throws InputError.
  void attach(std::span<const std::byte> bytes, const std::string& name);

 private:
  std::string name_;
  std::span<const std::byte> bytes_;
  std::vector<MapSection> sections_;
  std::span<const Bvh8Node> nodes_;
  std::span<const SurfelWord> words_;
  std::span<const std::uint8_t> intensity_;
  SurfelNotes notes_;
  std::string_view metadata_;
  std::optional<KnownSpace> known_;
  MapProperties properties_;
  IntensityLevels levels_;
  SurfelScale scale_;
  std::uint64_t file_size_ = 0;
  double reflectivity_ = 0.0;
};

/// What space the map's survey saw. Throws InputError if the map does not say.
const KnownSpace& known_space_of(const SurfelMap& map);

}  // namespace pointflight
