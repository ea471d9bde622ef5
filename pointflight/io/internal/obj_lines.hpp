// Wavefront OBJ ("Object Files (.obj)", Wavefront Technologies, appendix B1).
#pragma once

#include <string>
#include <string_view>

#include "pointflight/core/mapped_file.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {

/// Walks over the statements of an OBJ. Throws InputError with the line.
class ObjLines {
 public:
  /// The file must outlive the lines.
  explicit ObjLines(const MappedFile& file);

  /// The next statement that is no comment: its keyword and what follows; lines that end in a
  /// backslash go on. False at the end.
  bool next(std::string_view& keyword, std::string_view& rest);

  /// A vertex: x y z, which may be followed by a weight, or by red green blue from 0 to 1.
  [[nodiscard]] CloudPoint vertex(std::string_view rest, bool& has_color) const;

  [[nodiscard]] double share() const { return lines_.share(); }
  /// "place.obj:12"
  [[nodiscard]] std::string location() const;

 private:
  const MappedFile* file_;
  LineCursor lines_;
  std::string joined_;
};

}  // namespace pointflight
