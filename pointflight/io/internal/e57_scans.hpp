#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "pointflight/geometry/types.hpp"
#include "pointflight/io/internal/e57_pages.hpp"

namespace pointflight {

/// How the values of a field of points are stored (ASTM E2807).
struct E57Field {
  enum class Kind { kInteger, kSingle, kDouble };

  std::string name;           ///< "cartesianX"
  Kind kind = Kind::kDouble;  ///< Floats of 4 and 8 bytes; whole numbers packed to `bits`.
  std::int64_t minimum = 0;   ///< That whole numbers are counted from.
  unsigned bits = 64;         ///< Of a value: as few as the range wants, 0 if it is one value.
  double scale = 1.0;         ///< value = whole number * scale + offset
  double offset = 0.0;

  /// A stored value: a whole number above `minimum`, or a float's bits.
  [[nodiscard]] double value(std::uint64_t stored) const;
};

/// A scan of an E57 file: one child of data3D.
struct E57Scan {
  std::string name;              ///< As the file has it; may be empty.
  Pose T_world_scan;             ///< Identity if the file gives none.
  std::uint64_t section = 0;     ///< Physical offset of the section that holds its points.
  std::uint64_t points = 0;      ///< How many there are.
  std::vector<E57Field> fields;  ///< In the order of their byte streams.
  double color_scale = 1.0;      ///< Turns colours into 0 to 255.
  double color_offset = 0.0;     ///< Subtracted before.
};

/// The scans that the XML of a file lists. Throws InputError if it is no XML of E57, or lists no
/// scan, or a field of a type that is not read.
std::vector<E57Scan> e57_scans(const E57Pages& pages);

}  // namespace pointflight
