#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "pointflight/core/output_file.hpp"
#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {

/// One field of a binary PCD file.
struct PcdField {
  std::string name;  ///< "x", "intensity", ...
  char type;         ///< 'F', 'I' or 'U'.
  std::size_t size;  ///< Bytes.
};

/// Writes a binary PCD 0.7 file; `rows` holds `points` rows of the fields without padding;
/// throws std::invalid_argument if it does not.
void write_pcd(OutputFile file,
               const std::vector<PcdField>& fields,
               std::size_t points,
               std::span<const std::byte> rows);

/// Writes x y z [intensity] as float32, or x y z as float64 if a coordinate is beyond 4 km.
void write_cloud_pcd(OutputFile file, const std::vector<CloudPoint>& points, bool with_intensity);

}  // namespace pointflight
