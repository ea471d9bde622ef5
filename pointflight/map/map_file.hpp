#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pointflight/core/output_file.hpp"
#include "pointflight/map/bvh8.hpp"
#include "pointflight/map/surfel_map.hpp"

/// The `.pfmap` file: little endian, sections aligned to 64 bytes, used in place through mmap.
///
///   byte 0      header (below), 4096 bytes, zero-filled
///   ...         section: nodes      Bvh8Node[]
///   ...         section: words      u64[]: leaf headers and surfel words, 8 words of padding
///   ...         section: intensity  u8[], one a word (empty without intensities)
///   ...         section: metadata   JSON: how the map was made, from what, with which version
namespace pointflight {

inline constexpr char kMapMagic[8] = {'P', 'F', 'M', 'A', 'P', '\r', '\n', '\x1a'};
inline constexpr std::uint32_t kMapVersion = 1;
inline constexpr std::size_t kMapHeaderSize = 4096;
inline constexpr std::size_t kMapAlignment = 64;
inline constexpr double kMinResolution = 1e-6;  ///< m
inline constexpr double kMaxResolution = 1e6;

enum MapSectionId : std::uint32_t { kNodes, kWords, kIntensity, kMetadata, kMapSections };
inline constexpr const char* kMapSectionNames[kMapSections] = {
    "nodes", "words", "intensity", "metadata"};

struct MapSection {
  std::uint64_t offset;
  std::uint64_t size;      ///< Bytes.
  std::uint64_t checksum;  ///< XXH3-64 of the bytes.
};

struct MapHeader {
  char magic[8];
  std::uint32_t version;
  std::uint32_t section_count;
  double resolution;     ///< m
  double origin[3];      ///< World position of the corner of voxel (0, 0, 0), m.
  double bounds_min[3];  ///< Of the surfel centres, world, m.
  double bounds_max[3];
  float support, tau, window;  ///< RenderModel.
  float intensity_offset, intensity_step;
  std::uint32_t reserved;
  std::uint64_t surfel_count;
  MapSection sections[kMapSections];
};
static_assert(sizeof(MapHeader) <= kMapHeaderSize - 8);
/// The last 8 bytes of the header block are the XXH3-64 of the bytes before them.

/// What `write_map` stores beside the hierarchy.
struct MapDescription {
  double resolution = 0.0;
  Vector3d origin_world = Vector3d::Zero();
  Aabb bounds_world;
  RenderModel model;
  bool has_intensity = false;
  float intensity_offset = 0.0f;
  float intensity_step = 0.0f;
  std::uint64_t surfel_count = 0;
  std::string metadata;  ///< JSON.
};

/// Writes and commits a map: it appears under its name only when complete. Throws InputError.
void write_map(OutputFile file, const Bvh8& tree, const MapDescription& description);

/// The same bytes in memory.
std::vector<std::byte> map_bytes(const Bvh8& tree, const MapDescription& description);

}  // namespace pointflight
