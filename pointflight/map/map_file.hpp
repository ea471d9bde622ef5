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
///   byte 0      header (below), 4096 bytes, zero-filled
///   ...         section: nodes      Bvh8Node[]
///   ...         section: words      u64[]: leaf headers and surfel words, 8 words of padding
///   ...         section: intensity  u8[], one a word (empty without intensities)
///   ...         section: metadata   JSON: how the map was made, from what, with which version
namespace pointflight {

/// First bytes of every map; line ends and Ctrl-Z show text transfers that spoilt it.
inline constexpr char kMapMagic[8] = {'P', 'F', 'M', 'A', 'P', '\r', '\n', '\x1a'};
inline constexpr std::uint32_t kMapVersion = 1;      ///< Files of other versions are refused.
inline constexpr std::size_t kMapHeaderSize = 4096;  ///< Bytes.
inline constexpr std::size_t kMapAlignment = 64;     ///< Of sections, bytes.
inline constexpr double kMinResolution = 1e-6;       ///< m
inline constexpr double kMaxResolution = 1e6;        ///< m

/// Sections in the order in which they lie; the last is their number.
enum MapSectionId : std::uint32_t { kNodes, kWords, kIntensity, kMetadata, kMapSections };
/// For messages of `SurfelMap::verify`.
inline constexpr const char* kMapSectionNames[kMapSections] = {
    "nodes", "words", "intensity", "metadata"};

/// Where one section lies.
struct MapSection {
  std::uint64_t offset;    ///< Bytes from the file's start; a multiple of kMapAlignment.
  std::uint64_t size;      ///< Bytes.
  std::uint64_t checksum;  ///< XXH3-64 of the bytes.
};

/// First bytes of the file, as they lie there.
struct MapHeader {
  char magic[8];                ///< kMapMagic.
  std::uint32_t version;        ///< kMapVersion.
  std::uint32_t section_count;  ///< kMapSections.
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
  std::uint32_t reserved;             ///< Zero.
  std::uint64_t surfel_count;         ///< Leaf headers not counted.
  MapSection sections[kMapSections];  ///< By MapSectionId.
};
static_assert(sizeof(MapHeader) <= kMapHeaderSize - 8);
/// The last 8 bytes of the header block are the XXH3-64 of the bytes before them.

/// What `write_map` stores beside the hierarchy.
struct MapDescription {
  double resolution = 0.0;                   ///< r, m.
  Vector3d origin_world = Vector3d::Zero();  ///< Of the corner of voxel (0, 0, 0), m.
  Aabb bounds_world;                         ///< Of the surfel centres, m.
  RenderModel model;                         ///< Constants of the hit rule.
  bool has_intensity = false;                ///< The tree has intensities.
  float intensity_offset = 0.0f;             ///< Of byte 0, in the cloud's scale.
  float intensity_step = 0.0f;               ///< From one byte's value to the next.
  std::uint64_t surfel_count = 0;            ///< For `map info`.
  std::string metadata;                      ///< JSON.
};

/// Writes and commits a map: it appears under its name only when complete. Throws InputError.
void write_map(OutputFile file, const Bvh8& tree, const MapDescription& description);

/// The same bytes in memory.
std::vector<std::byte> map_bytes(const Bvh8& tree, const MapDescription& description);

}  // namespace pointflight
