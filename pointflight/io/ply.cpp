#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/file_unit.hpp"
#include "pointflight/io/formats.hpp"

// PLY as described by Greg Turk, "The PLY Polygon File Format" (1994).
namespace pointflight {
namespace {

enum class Scalar { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

std::optional<Scalar> scalar_type(std::string_view name) {
  if (name == "char" || name == "int8") return Scalar::kInt8;
  if (name == "uchar" || name == "uint8") return Scalar::kUint8;
  if (name == "short" || name == "int16") return Scalar::kInt16;
  if (name == "ushort" || name == "uint16") return Scalar::kUint16;
  if (name == "int" || name == "int32") return Scalar::kInt32;
  if (name == "uint" || name == "uint32") return Scalar::kUint32;
  if (name == "float" || name == "float32") return Scalar::kFloat;
  if (name == "double" || name == "float64") return Scalar::kDouble;
  return std::nullopt;
}

std::size_t size_of(Scalar type) {
  switch (type) {
    case Scalar::kInt8:
    case Scalar::kUint8:
      return 1;
    case Scalar::kInt16:
    case Scalar::kUint16:
      return 2;
    case Scalar::kDouble:
      return 8;
    default:
      return 4;
  }
}

double load_scalar(const std::byte* p, Scalar type, bool big) {
  switch (type) {
    case Scalar::kInt8:
      return load<std::int8_t>(p);
    case Scalar::kUint8:
      return load<std::uint8_t>(p);
    case Scalar::kInt16:
      return load<std::int16_t>(p, big);
    case Scalar::kUint16:
      return load<std::uint16_t>(p, big);
    case Scalar::kInt32:
      return load<std::int32_t>(p, big);
    case Scalar::kUint32:
      return load<std::uint32_t>(p, big);
    case Scalar::kFloat:
      return static_cast<double>(load<float>(p, big));
    case Scalar::kDouble:
      return load<double>(p, big);
  }
  return 0.0;
}

struct Property {
  std::string name;
  Scalar type = Scalar::kFloat;
  std::optional<Scalar> count_type;  ///< Set for lists.
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  bool ascii = false;
  bool big_endian = false;
  std::vector<Element> elements;
  std::size_t data_offset = 0;
  std::size_t data_line = 0;
  std::optional<FileUnit> unit;
};

class HeaderParser {
 public:
  explicit HeaderParser(const MappedFile& file) : file_(file), lines_(as_text(file.bytes())) {}

  Header parse() {
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
    for (const Element& element : header_.elements) {
      if (element.count > 0 && element.properties.empty()) {
        fail(fmt::format("element '{}' has rows but no properties", excerpt(element.name)));
      }
      double row = 0.0;  // at least
      for (const Property& property : element.properties) {
        const Scalar first = property.count_type.value_or(property.type);
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
    Element& element = header_.elements.emplace_back();
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
    Property& property = header_.elements.back().properties.emplace_back();
    std::string_view word = take_word(line);
    if (word == "list") {
      property.count_type = type(take_word(line));
      word = take_word(line);
    }
    property.type = type(word);
    property.name = std::string(take_word(line));
  }

  Scalar type(std::string_view word) {
    const auto found = scalar_type(word);
    if (!found) fail(fmt::format("property type '{}' is unknown", excerpt(word)));
    return *found;
  }

  const MappedFile& file_;
  LineCursor lines_;
  Header header_;
};

bool is_intensity(std::string_view name) {
  return name == "intensity" || name == "scalar_intensity" || name == "scalar_Intensity" ||
         name == "Intensity" || name == "reflectance" || name == "scalar_reflectance";
}

class PlyReader : public CloudReader {
 public:
  explicit PlyReader(MappedFile file)
      : file_(std::move(file)),
        header_(HeaderParser(file_).parse()),
        at_(header_.data_offset),
        lines_(as_text(file_.bytes()).substr(header_.data_offset)) {
    std::size_t element = 0;
    while (element < header_.elements.size() && header_.elements[element].name != "vertex") {
      ++element;
    }
    if (element == header_.elements.size()) {
      throw InputError(fmt::format("{}: no 'vertex' element in the PLY header", file_.path()));
    }
    vertex_ = header_.elements[element];
    find_columns();
    for (std::size_t i = 0; i < element; ++i) skip(header_.elements[i]);
    file_.will_read_sequentially();
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    const std::uint64_t count = std::min<std::uint64_t>(kBatch, vertex_.count - next_);
    values_.resize(vertex_.properties.size());
    while (batch.size() < count) {
      read_row(vertex_);
      CloudPoint& point = batch.emplace_back();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        point.position[static_cast<int>(axis)] = values_[position_[axis]];
      }
      if (intensity_) point.intensity = static_cast<float>(values_[*intensity_]);
      if (has_color()) {
        for (std::size_t c = 0; c < 3; ++c) point.color[c] = color_part(*color_[c]);
      }
      ++next_;
    }
    if (!header_.ascii) file_.release_before(at_);
    return !batch.empty();
  }

  /// Goes over what has not been read.
  void skip_rest() {
    bool behind = false;
    for (const Element& element : header_.elements) {
      behind = behind || element.name == "vertex";
      if (behind) skip(element);
    }
  }

  [[nodiscard]] bool has_intensity() const override { return intensity_.has_value(); }
  [[nodiscard]] bool has_color() const override { return color_[0] && color_[1] && color_[2]; }
  [[nodiscard]] std::optional<FileUnit> unit() const override { return header_.unit; }
  [[nodiscard]] double share_read() const override {
    return vertex_.count == 0 ? 1.0
                              : static_cast<double>(next_) / static_cast<double>(vertex_.count);
  }

 private:
  void find_columns() {
    position_.fill(std::numeric_limits<std::size_t>::max());
    for (std::size_t i = 0; i < vertex_.properties.size(); ++i) {
      const Property& property = vertex_.properties[i];
      if (property.count_type) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (property.name == std::string(1, "xyz"[axis])) position_[axis] = i;
      }
      if (is_intensity(property.name)) intensity_ = i;
      for (std::size_t c = 0; c < 3; ++c) {
        constexpr std::array<std::string_view, 3> kColors = {"red", "green", "blue"};
        if (property.name == kColors[c] || property.name == fmt::format("diffuse_{}", kColors[c])) {
          color_[c] = i;
        }
      }
    }
    for (const std::size_t column : position_) {
      if (column == std::numeric_limits<std::size_t>::max()) {
        throw InputError(fmt::format("{}: the 'vertex' element lacks x, y or z", file_.path()));
      }
    }
  }

  /// Whole numbers fill their type, others go from 0 to 1.
  [[nodiscard]] std::uint8_t color_part(std::size_t column) const {
    const Scalar type = vertex_.properties[column].type;
    double value = values_[column];
    if (type == Scalar::kFloat || type == Scalar::kDouble) value *= 255.0;
    if (type == Scalar::kInt16 || type == Scalar::kUint16) value /= 257.0;
    return value > 0.0 ? static_cast<std::uint8_t>(std::min(value + 0.5, 255.0)) : std::uint8_t{0};
  }

  void skip(const Element& element) {
    values_.resize(element.properties.size());
    for (std::uint64_t i = 0; i < element.count; ++i) read_row(element);
  }

  void read_row(const Element& element) {
    if (header_.ascii) {
      read_ascii_row(element);
    } else {
      read_binary_row(element);
    }
  }

  void read_binary_row(const Element& element) {
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const Property& property = element.properties[i];
      if (property.count_type) {
        const double items = take(*property.count_type);
        const double bytes = items * static_cast<double>(size_of(property.type));
        if (!(items >= 0.0) || bytes > static_cast<double>(file_.bytes().size() - at_)) {
          fail_byte("a list is longer than the file");
        }
        at_ += static_cast<std::size_t>(bytes);
      } else {
        values_[i] = take(property.type);
      }
    }
  }

  double take(Scalar type) {
    const std::size_t size = size_of(type);
    if (size > file_.bytes().size() - at_) fail_byte("the file is cut off");
    const double value = load_scalar(file_.bytes().data() + at_, type, header_.big_endian);
    at_ += size;
    return value;
  }

  void read_ascii_row(const Element& element) {
    std::string_view line;
    do {
      if (!lines_.next(line)) {
        throw InputError(fmt::format("{}:{}: the file ends before its {} '{}' rows are complete",
                                     file_.path(),
                                     header_.data_line + lines_.number(),
                                     element.count,
                                     element.name));
      }
    } while (line.find_first_not_of(" \t") == std::string_view::npos);
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const double value = number(line);
      if (!element.properties[i].count_type) {
        values_[i] = value;
        continue;
      }
      if (!(value >= 0.0) || value > static_cast<double>(line.size())) {
        fail_line("a list's length does not fit its line");
      }
      for (auto k = static_cast<std::uint64_t>(value); k > 0; --k) number(line);
    }
  }

  double number(std::string_view& line) {
    const std::string_view word = take_word(line);
    double value = 0.0;
    if (!parse_number(word, value)) {
      fail_line(word.empty() ? std::string("too few numbers")
                             : fmt::format("'{}' is no number", excerpt(word)));
    }
    return value;
  }

  [[noreturn]] void fail_line(const std::string& what) const {
    throw InputError(
        fmt::format("{}:{}: {}", file_.path(), header_.data_line + lines_.number(), what));
  }
  [[noreturn]] void fail_byte(const std::string& what) const {
    throw InputError(fmt::format("{}: byte {}: {}", file_.path(), at_, what));
  }

  MappedFile file_;
  Header header_;
  Element vertex_;
  std::array<std::size_t, 3> position_{};
  std::optional<std::size_t> intensity_;
  std::array<std::optional<std::size_t>, 3> color_;
  std::vector<double> values_;
  std::size_t at_;
  LineCursor lines_;
  std::uint64_t next_ = 0;
};

}  // namespace

std::unique_ptr<CloudReader> open_ply(MappedFile file) {
  return std::make_unique<PlyReader>(std::move(file));
}

void check_ply_rows(MappedFile file) {
  PlyReader(std::move(file)).skip_rest();
}

bool ply_has_faces(const MappedFile& file) {
  const Header header = HeaderParser(file).parse();
  return std::any_of(header.elements.begin(), header.elements.end(), [](const Element& element) {
    return (element.name == "face" || element.name == "tristrips") && element.count > 0;
  });
}

}  // namespace pointflight
