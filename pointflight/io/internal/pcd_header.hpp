// The header of a PCD file (0.7, as documented by the Point Cloud Library).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/mapped_file.hpp"
#include "pointflight/io/file_unit.hpp"

namespace pointflight {

struct PcdColumn {
  std::string name;
  std::size_t size = 4;
  char type = 'F';
  std::size_t count = 1;
  std::size_t offset = 0;  ///< Bytes from the start of a point; column index in ascii files.
};

enum class PcdEncoding { kAscii, kBinary, kBinaryCompressed };

struct PcdHeader {
  std::vector<PcdColumn> fields;
  std::uint64_t points = 0;
  bool has_points = false;
  std::uint64_t width = 0, height = 1;  ///< As the file has them.
  PcdEncoding encoding = PcdEncoding::kAscii;
  std::size_t point_size = 0;
  std::size_t columns = 0;
  std::size_t data_offset = 0;
  std::size_t data_line = 0;
  std::optional<FileUnit> unit;
  std::string viewpoint;  ///< As the file has it, if it is not the identity.
};

/// Throws InputError with line or byte.
PcdHeader parse_pcd_header(const MappedFile& file);

}  // namespace pointflight
