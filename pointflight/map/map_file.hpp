#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pointflight/core/output_file.hpp"
#include "pointflight/map/bvh8.hpp"
#include "pointflight/map/surfel_map.hpp"

/// @file
/// The `.pfmap` file: little endian, sections aligned to 64 bytes, used in place through mmap.
///
///   byte 0      header block, 4096 bytes, zero-filled: MapHeader, then a MapSection for each
///               section, in its last 8 bytes the XXH3-64 of all before them
///   ...         section: nodes      Bvh8Node[]
///   ...         section: words      u64[]: leaf headers and surfel words, 8 words of padding
///   ...         section: intensity  u8[], one per word; optional
///   ...         section: metadata   JSON: how the map was made, from what, with which version;
///   optional
///   ...         section: known_space  which space a survey saw (known_space.hpp); optional
///   ...         section: reflectivity  f64: reflectivity per unit of intensity; optional
///   ...         section: assumed    a bit per word: surfels that no survey saw; optional
///   ...         section: labels     u32[]: class << 24 | thing of each word; optional
///   ...         section: classes    text: names of these classes, a line each; optional
///   ...         section: opacity    u8[]: which beams come back from each word; optional
///   ...         section: fitted     u64[]: the scans that it was fitted to; optional
///   ...         section: levels     f32[256]: intensity of each byte, if steps are not equal;
///   optional
///   ...         any others, which readers that do not know them leave alone
///
/// Version 1 had these four sections and no names for them: its table is four MapSectionV1.
namespace pointflight {

/// First bytes of every map; line ends and Ctrl-Z show text transfers that spoilt it.
inline constexpr char kMapMagic[8] = {'P', 'F', 'M', 'A', 'P', '\r', '\n', '\x1a'};
inline constexpr std::uint32_t kMapVersion = 2;        ///< Written.
inline constexpr std::uint32_t kMapOldestVersion = 1;  ///< Read as well; newer ones are refused.
inline constexpr std::size_t kMapHeaderSize = 4096;    ///< Bytes.
inline constexpr std::size_t kMapAlignment = 64;       ///< Of sections, bytes.
inline constexpr double kMinResolution = 1e-6;         ///< m
inline constexpr double kMaxResolution = 1e6;          ///< m

/// A MapSection of version 1: nodes, words, intensity, metadata.
struct MapSectionV1 {
  std::uint64_t offset;    ///< As above.
  std::uint64_t size;      ///< Bytes; zero if there is none.
  std::uint64_t checksum;  ///< As above.
};
/// The sections of version 1, in their order.
inline constexpr const char* kMapSectionNames[] = {"nodes", "words", "intensity", "metadata"};

/// First bytes of the file, as they lie there.
struct MapHeader {
  char magic[8];                ///< kMapMagic.
  std::uint32_t version;        ///< kMapVersion.
  std::uint32_t section_count;  ///< At most kMapSectionsMax.
  double resolution;            ///< m
  double origin[3];             ///< World position of the corner of voxel (0, 0, 0), m.
  double bounds_min[3];         ///< Of the surfel centres, world, m.
  double bounds_max[3];         ///< m
  /// RenderModel.
  ///@{
  float support, tau, window;
  ///@}
  /// Intensity of byte b: offset + step * b, in the cloud's scale.
  ///@{
  float intensity_offset, intensity_step;
  ///@}
  std::uint32_t reserved;      ///< Zero.
  std::uint64_t surfel_count;  ///< Leaf headers not counted.
};
static_assert(sizeof(MapHeader) == 128 && sizeof(MapSection) == 40 && sizeof(MapSectionV1) == 24);
/// As many as fit into the header block.
inline constexpr std::size_t kMapSectionsMax =
    (kMapHeaderSize - 8 - sizeof(MapHeader)) / sizeof(MapSection);

/// A section beside those that every map has.
struct ExtraSection {
  std::string name;              ///< Up to 16 bytes, not one of `kMapSectionNames`.
  std::vector<std::byte> bytes;  ///< Its content.
};

/// What `write_map` stores beside the hierarchy.
struct MapDescription : MapProperties {
  bool has_intensity = false;       ///< The tree has intensities.
  std::string metadata;             ///< JSON.
  std::vector<ExtraSection> extra;  ///< Further sections; edits keep what they know.
};

/// Puts an extra section in place of one of the same name; empty bytes remove it.
void set_section(MapDescription& description, const char* name, std::vector<std::byte> bytes);

/// Says what reflectivity a unit of the map's intensity stands for; 0: that it is not known.
void set_reflectivity(MapDescription& description, double per_intensity);

/// Says what the codes of intensities stand for.
void set_levels(MapDescription& description, const IntensityLevels& levels);

/// Writes and commits a map: it appears under its name only when complete. Throws InputError.
void write_map(OutputFile file, const Bvh8& tree, const MapDescription& description);

/// The same bytes in memory.
std::vector<std::byte> map_bytes(const Bvh8& tree, const MapDescription& description);

}  // namespace pointflight
