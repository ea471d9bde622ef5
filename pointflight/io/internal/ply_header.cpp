#include "pointflight/io/internal/ply_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/formats.hpp"

namespace pointflight {
namespace {

std::optional<PlyScalar> scalar_type(std::string_view name) {
  if (name == "char" || name == "int8") return PlyScalar::kInt8;
  if (name == "uchar" || name == "uint8") return PlyScalar::kUint8;
  if (name == "short" || name == "int16") return PlyScalar::kInt16;
  if (name == "ushort" || name == "uint16") return PlyScalar::kUint16;
  if (name == "int" || name == "int32") return PlyScalar::kInt32;
  if (name == "uint" || name == "uint32") return PlyScalar::kUint32;
  if (name == "float" || name == "float32") return PlyScalar::kFloat;
  if (name == "double" || name == "float64") return PlyScalar::kDouble;
  return std::nullopt;
}

class PlyHeaderParser {
 public:
  explicit PlyHeaderParser(const MappedFile& file) : file_(file), lines_(as_text(file.bytes())) {}

  PlyHeader parse() {
    std::string_view line;
    if (!lines_.next(line) || line != "ply") fail("the first line is not 'ply'");
    bool has_format = false;
    while (lines_.next(line)) {
      const std::string_view key = take_word(line);
      if (key == "end_header") {
        if (!has_format) fail("no format line before end_header");
        header_.data_offset = lines_.offset();
        header_.data_line = lines_.number();
        check_length();
        return header_;
      }
      if (key == "comment" || key == "obj_info") {
        if (!header_.unit) header_.unit = unit_in_comment(line);
        continue;
      }
      if (key.empty()) continue;
      if (key == "format") {
        parse_format(take_word(line));
        has_format = true;
      } else if (key == "element") {
        parse_element(line);
      } else if (key == "property") {
        parse_property(line);
      } else {
        fail(fmt::format("'{}' is not a PLY header key", excerpt(key)));
      }
      if (lines_.number() > 1000) fail("no end_header within 1000 lines");
    }
    fail("the header has no end_header line; the file is cut off or not a PLY file");
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}: {}", file_.path(), lines_.number(), what));
  }

  /// A header that promises more than the file can hold is found before anything is read.
  void check_length() const {
    auto room = static_cast<double>(file_.bytes().size() - header_.data_offset);
    for (const PlyElement& element : header_.elements) {
      if (element.count > 0 && element.properties.empty()) {
        fail(fmt::format("element '{}' has rows but no properties", excerpt(element.name)));
      }
      double row = 0.0;  // at least
      for (const PlyProperty& property : element.properties) {
        const PlyScalar first = property.count_type.value_or(property.type);
        row += header_.ascii ? 1.0 : static_cast<double>(size_of(first));
      }
      if (row * static_cast<double>(element.count) > room) {
        throw InputError(
            fmt::format("{}: byte {}: the header promises {} '{}' rows, the file has room for {}; "
                        "it is cut off "
                        "or its header is wrong",
                        file_.path(),
                        file_.bytes().size(),
                        element.count,
                        excerpt(element.name),
                        static_cast<std::uint64_t>(room / row)));
      }
      room -= row * static_cast<double>(element.count);
    }
  }

  void parse_format(std::string_view word) {
    header_.ascii = word == "ascii";
    header_.big_endian = word == "binary_big_endian";
    if (!header_.ascii && !header_.big_endian && word != "binary_little_endian") {
      fail(fmt::format("format '{}' is unknown; ascii, binary_little_endian or binary_big_endian",
                       excerpt(word)));
    }
  }

  void parse_element(std::string_view line) {
    PlyElement& element = header_.elements.emplace_back();
    element.name = std::string(take_word(line));
    const std::string_view word = take_word(line);
    double count = -1.0;
    if (!parse_number(word, count) || !(count >= 0.0) || !(count <= 1e12)) {
      fail(fmt::format("element count '{}' is not a whole number", excerpt(word)));
    }
    element.count = static_cast<std::uint64_t>(count);
  }

  void parse_property(std::string_view line) {
    if (header_.elements.empty()) fail("a property before the first element");
    PlyProperty& property = header_.elements.back().properties.emplace_back();
    std::string_view word = take_word(line);
    if (word == "list") {
      property.count_type = type(take_word(line));
      word = take_word(line);
    }
    property.type = type(word);
    property.name = std::string(take_word(line));
  }

  PlyScalar type(std::string_view word) {
    const auto found = scalar_type(word);
    if (!found) fail(fmt::format("property type '{}' is unknown", excerpt(word)));
    return *found;
  }

  const MappedFile& file_;
  LineCursor lines_;
  PlyHeader header_;
};

}  // namespace

std::size_t size_of(PlyScalar type) {
  switch (type) {
    case PlyScalar::kInt8:
    case PlyScalar::kUint8:
      return 1;
    case PlyScalar::kInt16:
    case PlyScalar::kUint16:
      return 2;
    case PlyScalar::kDouble:
      return 8;
    default:
      return 4;
  }
}

double load_scalar(const std::byte* p, PlyScalar type, bool big) {
  switch (type) {
    case PlyScalar::kInt8:
      return load<std::int8_t>(p);
    case PlyScalar::kUint8:
      return load<std::uint8_t>(p);
    case PlyScalar::kInt16:
      return load<std::int16_t>(p, big);
    case PlyScalar::kUint16:
      return load<std::uint16_t>(p, big);
    case PlyScalar::kInt32:
      return load<std::int32_t>(p, big);
    case PlyScalar::kUint32:
      return load<std::uint32_t>(p, big);
    case PlyScalar::kFloat:
      return static_cast<double>(load<float>(p, big));
    case PlyScalar::kDouble:
      return load<double>(p, big);
  }
  return 0.0;
}

PlyHeader parse_ply_header(const MappedFile& file) {
  return PlyHeaderParser(file).parse();
}

std::size_t vertex_element(const PlyHeader& header, const std::string& path) {
  const auto found =
      std::find_if(header.elements.begin(), header.elements.end(), [](const PlyElement& element) {
        return element.name == "vertex";
      });
  if (found == header.elements.end()) {
    throw InputError(fmt::format("{}: no 'vertex' element in the PLY header", path));
  }
  return static_cast<std::size_t>(found - header.elements.begin());
}

}  // namespace pointflight
