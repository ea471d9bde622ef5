#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "pointflight/core/mapped_file.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/internal/ply_header.hpp"

namespace pointflight {

/// No column of lists is wanted.
inline constexpr std::size_t kNoList = std::numeric_limits<std::size_t>::max();

/// Walks over the rows behind a PLY's header, element by element. A copy goes on by itself from
/// where it was made. Throws InputError with line or byte.
class PlyRows {
 public:
  /// At the first row of the first element; both must outlive the rows.
  PlyRows(const MappedFile& file, const PlyHeader& header);

  /// Reads a row of an element, whose turn it is: a value for each property, 0 for lists.
  /// @param list  The items of property `list_column`, if it is one of the element's lists.
  void read(const PlyElement& element,
            std::vector<double>& values,
            std::vector<double>& list,
            std::size_t list_column = kNoList);
  /// Goes over all rows of an element.
  void skip(const PlyElement& element);

  /// Bytes of the file up to the next row.
  [[nodiscard]] std::size_t offset() const;
  /// "mesh.ply:12", "mesh.ply: byte 90": of the row that was read last.
  [[nodiscard]] std::string location() const;

 private:
  void read_binary(const PlyElement& element,
                   std::vector<double>& values,
                   std::vector<double>& list,
                   std::size_t list_column);
  void read_ascii(const PlyElement& element,
                  std::vector<double>& values,
                  std::vector<double>& list,
                  std::size_t list_column);
  double take(PlyScalar type);
  double number(std::string_view& line);
  [[noreturn]] void fail(const std::string& what) const;

  const MappedFile* file_;
  const PlyHeader* header_;
  std::size_t at_;
  LineCursor lines_;
};

}  // namespace pointflight
