#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {

/// The unit that a comment of a header names: "units: mm", "File units = millimeters". Nothing
/// if it names none.
std::optional<FileUnit> unit_in_comment(std::string_view comment);

/// The unit of a LAS file's coordinates, from the variable-length records of its header: GeoTIFF
/// keys (record 34735) or well-known text (record 2112). `records` is what lies between the header
/// and the points.
std::optional<FileUnit> unit_in_las_records(std::span<const std::byte> records, std::size_t count);

}  // namespace pointflight
