#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/file_unit.hpp"
#include "pointflight/io/formats.hpp"
#include "pointflight/io/internal/column_names.hpp"
#include "pointflight/io/internal/ply_header.hpp"
#include "pointflight/io/internal/ply_rows.hpp"

// PLY as described by Greg Turk, "The PLY Polygon File Format" (1994).
namespace pointflight {
namespace {

class PlyReader : public CloudReader {
 public:
  explicit PlyReader(MappedFile file)
      : file_(std::move(file)), header_(parse_ply_header(file_)), rows_(file_, header_) {
    vertex_ = vertex_element(header_, file_.path());
    find_columns();
    for (std::size_t i = 0; i < vertex_; ++i) rows_.skip(header_.elements[i]);
    file_.will_read_sequentially();
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    raw_.clear();
    const PlyElement& vertex = header_.elements[vertex_];
    const std::uint64_t count = std::min<std::uint64_t>(kBatch, vertex.count - next_);
    while (batch.size() < count) {
      rows_.read(vertex, values_, list_);
      CloudPoint& point = batch.emplace_back();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        point.position[static_cast<int>(axis)] = values_[position_[axis]];
      }
      if (intensity_) point.intensity = static_cast<float>(values_[*intensity_]);
      if (has_color()) {
        for (std::size_t c = 0; c < 3; ++c) point.color[c] = color_part(*color_[c]);
      }
      if (keeps_raw_) {
        for (const std::size_t column : raw_columns_) keep_raw_value(vertex, column);
      }
      ++next_;
    }
    file_.release_before(rows_.offset());
    return !batch.empty();
  }

  [[nodiscard]] bool has_intensity() const override { return intensity_.has_value(); }
  [[nodiscard]] bool has_color() const override { return color_[0] && color_[1] && color_[2]; }
  [[nodiscard]] std::vector<RawColumn> raw_columns() const override {
    std::vector<RawColumn> columns;
    for (const std::size_t column : raw_columns_) {
      const PlyProperty& property = header_.elements[vertex_].properties[column];
      columns.push_back({property.name, kind_of(property.type), size_of(property.type)});
    }
    return columns;
  }
  void keep_raw() override { keeps_raw_ = true; }
  [[nodiscard]] std::span<const std::byte> raw() const override { return raw_; }
  [[nodiscard]] FileColumns columns() const override { return about_; }
  [[nodiscard]] std::optional<FileUnit> unit() const override { return header_.unit; }
  [[nodiscard]] double share_read() const override {
    const auto count = static_cast<double>(header_.elements[vertex_].count);
    return count == 0.0 ? 1.0 : static_cast<double>(next_) / count;
  }

 private:
  void find_columns() {
    std::vector<std::string> names;
    for (const PlyProperty& property : header_.elements[vertex_].properties) {
      names.push_back(property.count_type ? std::string() : property.name);
    }
    const NamedColumns columns(names);
    if (!columns.has_position()) {
      throw InputError(fmt::format("{}: the 'vertex' element lacks x, y or z", file_.path()));
    }
    for (std::size_t i = 0; i < 3; ++i) {
      position_[i] = columns.at(static_cast<ColumnRole>(i));
      constexpr std::array kParts = {ColumnRole::kRed, ColumnRole::kGreen, ColumnRole::kBlue};
      if (columns.has_color()) color_[i] = columns.at(kParts[i]);
    }
    intensity_ = columns.find(ColumnRole::kIntensity);
    about_ = columns.about();
    std::vector<bool> is_taken(names.size(), false);
    for (const std::size_t axis : position_) is_taken[axis] = true;
    if (intensity_) is_taken[*intensity_] = true;
    for (const auto& part : color_) {
      if (part) is_taken[*part] = true;
    }
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (!is_taken[i] && !names[i].empty()) raw_columns_.push_back(i);
    }
  }

  /// As in PCD.
  static char kind_of(PlyScalar type) {
    switch (type) {
      case PlyScalar::kFloat:
      case PlyScalar::kDouble:
        return 'F';
      case PlyScalar::kInt8:
      case PlyScalar::kInt16:
      case PlyScalar::kInt32:
        return 'I';
      default:
        return 'U';
    }
  }

  /// Of the row that was read; a whole number out of its type's range, which a text may have, is 0.
  void keep_raw_value(const PlyElement& vertex, std::size_t column) {
    const PlyScalar type = vertex.properties[column].type;
    const double value = values_[column];
    const auto keep = [&](auto number) {
      const auto* bytes = reinterpret_cast<const std::byte*>(&number);
      raw_.insert(raw_.end(), bytes, bytes + size_of(type));
    };
    if (type == PlyScalar::kFloat) return keep(static_cast<float>(value));
    if (type == PlyScalar::kDouble) return keep(value);
    keep(std::abs(value) < 4294967296.0 ? static_cast<std::int64_t>(value) : 0);
  }

  /// Whole numbers fill their type, others go from 0 to 1.
  [[nodiscard]] std::uint8_t color_part(std::size_t column) const {
    const PlyScalar type = header_.elements[vertex_].properties[column].type;
    double value = values_[column];
    if (type == PlyScalar::kFloat || type == PlyScalar::kDouble) value *= 255.0;
    if (type == PlyScalar::kInt16 || type == PlyScalar::kUint16) value /= 257.0;
    return value > 0.0 ? static_cast<std::uint8_t>(std::min(value + 0.5, 255.0)) : std::uint8_t{0};
  }

  MappedFile file_;
  PlyHeader header_;
  PlyRows rows_;
  std::size_t vertex_ = 0;  // element
  FileColumns about_;
  std::array<std::size_t, 3> position_{};
  std::optional<std::size_t> intensity_;
  std::array<std::optional<std::size_t>, 3> color_;
  std::vector<std::size_t> raw_columns_;
  bool keeps_raw_ = false;
  std::vector<std::byte> raw_;
  std::vector<double> values_;
  std::vector<double> list_;
  std::uint64_t next_ = 0;
};

}  // namespace

std::unique_ptr<CloudReader> open_ply(MappedFile file) {
  return std::make_unique<PlyReader>(std::move(file));
}

bool ply_has_faces(const MappedFile& file) {
  const PlyHeader header = parse_ply_header(file);
  return std::any_of(header.elements.begin(), header.elements.end(), [](const PlyElement& element) {
    return (element.name == "face" || element.name == "tristrips") && element.count > 0;
  });
}

}  // namespace pointflight
