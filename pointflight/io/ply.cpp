#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/file_unit.hpp"
#include "pointflight/io/formats.hpp"
#include "pointflight/io/internal/ply_header.hpp"

// PLY as described by Greg Turk, "The PLY Polygon File Format" (1994).
namespace pointflight {
namespace {

bool is_intensity(std::string_view name) {
  return name == "intensity" || name == "scalar_intensity" || name == "scalar_Intensity" ||
         name == "Intensity" || name == "reflectance" || name == "scalar_reflectance";
}

class PlyReader : public CloudReader {
 public:
  explicit PlyReader(MappedFile file)
      : file_(std::move(file)),
        header_(parse_ply_header(file_)),
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
    for (const PlyElement& element : header_.elements) {
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
      const PlyProperty& property = vertex_.properties[i];
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
    const PlyScalar type = vertex_.properties[column].type;
    double value = values_[column];
    if (type == PlyScalar::kFloat || type == PlyScalar::kDouble) value *= 255.0;
    if (type == PlyScalar::kInt16 || type == PlyScalar::kUint16) value /= 257.0;
    return value > 0.0 ? static_cast<std::uint8_t>(std::min(value + 0.5, 255.0)) : std::uint8_t{0};
  }

  void skip(const PlyElement& element) {
    values_.resize(element.properties.size());
    for (std::uint64_t i = 0; i < element.count; ++i) read_row(element);
  }

  void read_row(const PlyElement& element) {
    if (header_.ascii) {
      read_ascii_row(element);
    } else {
      read_binary_row(element);
    }
  }

  void read_binary_row(const PlyElement& element) {
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
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

  double take(PlyScalar type) {
    const std::size_t size = size_of(type);
    if (size > file_.bytes().size() - at_) fail_byte("the file is cut off");
    const double value = load_scalar(file_.bytes().data() + at_, type, header_.big_endian);
    at_ += size;
    return value;
  }

  void read_ascii_row(const PlyElement& element) {
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
  PlyHeader header_;
  PlyElement vertex_;
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
  const PlyHeader header = parse_ply_header(file);
  return std::any_of(header.elements.begin(), header.elements.end(), [](const PlyElement& element) {
    return (element.name == "face" || element.name == "tristrips") && element.count > 0;
  });
}

}  // namespace pointflight
