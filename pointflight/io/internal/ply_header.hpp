// The header of a PLY file (Greg Turk, "The PLY Polygon File Format", 1994).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/mapped_file.hpp"
#include "pointflight/io/file_unit.hpp"

namespace pointflight {

enum class PlyScalar { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

/// Bytes.
std::size_t size_of(PlyScalar type);
/// `big`: big-endian.
double load_scalar(const std::byte* p, PlyScalar type, bool big);

struct PlyProperty {
  std::string name;
  PlyScalar type = PlyScalar::kFloat;
  std::optional<PlyScalar> count_type;  ///< Set for lists.
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  bool ascii = false;
  bool big_endian = false;
  std::vector<PlyElement> elements;
  std::size_t data_offset = 0;
  std::size_t data_line = 0;
  std::optional<FileUnit> unit;
};

/// Throws InputError with line or byte.
PlyHeader parse_ply_header(const MappedFile& file);

/// The number of the element of vertices. Throws InputError if there is none.
std::size_t vertex_element(const PlyHeader& header, const std::string& path);

}  // namespace pointflight
