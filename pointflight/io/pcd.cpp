#include <fmt/format.h>
#include <liblzf/lzf.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <optional>

#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/file_unit.hpp"
#include "pointflight/io/formats.hpp"
#include "pointflight/io/internal/column_names.hpp"
#include "pointflight/io/internal/pcd_header.hpp"

// PCD 0.7 as documented by the Point Cloud Library, "The PCD (Point Cloud Data) file format".
namespace pointflight {
namespace {

double load_number(const std::byte* p, char type, std::size_t size) {
  if (type == 'F') return size == 8 ? load<double>(p) : static_cast<double>(load<float>(p));
  const bool is_signed = type == 'I';
  switch (size) {
    case 1:
      return is_signed ? load<std::int8_t>(p) : load<std::uint8_t>(p);
    case 2:
      return is_signed ? load<std::int16_t>(p) : load<std::uint16_t>(p);
    case 4:
      return is_signed ? load<std::int32_t>(p) : load<std::uint32_t>(p);
    default:
      return is_signed ? static_cast<double>(load<std::int64_t>(p))
                       : static_cast<double>(load<std::uint64_t>(p));
  }
}

class PcdReader : public CloudReader {
 public:
  explicit PcdReader(MappedFile file) : file_(std::move(file)), header_(parse_pcd_header(file_)) {
    find_columns();
    if (header_.encoding == PcdEncoding::kAscii) {
      lines_.emplace(as_text(file_.bytes()).substr(header_.data_offset));
    } else if (header_.encoding == PcdEncoding::kBinary) {
      check_binary_length();
    } else {
      decompress();
    }
    file_.will_read_sequentially();
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    times_.clear();
    rings_.clear();
    raw_.clear();
    const std::uint64_t count = std::min<std::uint64_t>(kBatch, header_.points - next_);
    if (header_.encoding == PcdEncoding::kAscii) {
      read_ascii(count, batch);
    } else {
      read_binary(count, batch);
    }
    next_ += batch.size();
    return !batch.empty();
  }

  [[nodiscard]] bool has_intensity() const override { return intensity_.has_value(); }
  [[nodiscard]] bool has_color() const override { return color_.has_value(); }
  [[nodiscard]] std::span<const double> times() const override { return times_; }
  [[nodiscard]] double time_unit() const override { return time_unit_; }
  [[nodiscard]] std::span<const std::int32_t> rings() const override { return rings_; }
  [[nodiscard]] std::vector<RawColumn> raw_columns() const override {
    std::vector<RawColumn> columns;
    for (const PcdColumn& field : raw_fields_) {
      columns.push_back({field.name, field.type, field.size});
    }
    return columns;
  }
  void keep_raw() override { keeps_raw_ = true; }
  [[nodiscard]] std::span<const std::byte> raw() const override { return raw_; }
  [[nodiscard]] std::optional<CloudShape> shape() const override {
    const auto [width, height] = std::pair(header_.width, header_.height);
    const bool fits =
        height > 1 && width > 0 && header_.points / height == width && header_.points % height == 0;
    return fits ? std::optional(CloudShape{width, height}) : std::nullopt;
  }
  [[nodiscard]] FileColumns columns() const override { return about_; }
  [[nodiscard]] std::optional<FileUnit> unit() const override { return header_.unit; }
  [[nodiscard]] double share_read() const override {
    return header_.points == 0 ? 1.0
                               : static_cast<double>(next_) / static_cast<double>(header_.points);
  }

 private:
  void find_columns() {
    std::vector<std::string> names;
    for (const PcdColumn& field : header_.fields) {
      names.push_back(field.count > 0 ? field.name : std::string());
    }
    const NamedColumns columns(names);
    const auto find = [&](ColumnRole role) -> std::optional<PcdColumn> {
      const auto column = columns.find(role);
      return column ? std::optional(header_.fields[*column]) : std::nullopt;
    };
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto field = find(static_cast<ColumnRole>(axis));
      if (!field) {
        throw InputError(fmt::format("{}: no field '{}' in the PCD header; x, y and z are needed",
                                     file_.path(),
                                     "xyz"[axis]));
      }
      position_[axis] = *field;
    }
    intensity_ = find(ColumnRole::kIntensity);
    time_ = find(ColumnRole::kTime);
    ring_ = find(ColumnRole::kRing);
    color_ = find(ColumnRole::kPackedColor);
    if (color_ && color_->size != 4) color_.reset();
    for (const PcdColumn& field : header_.fields) {
      const auto is_it = [&](const std::optional<PcdColumn>& other) {
        return other && other->offset == field.offset;
      };
      const bool is_position = std::any_of(
          position_.begin(), position_.end(), [&](const auto& axis) { return is_it(axis); });
      if (field.count != 1 || field.name == "_" || is_position || is_it(intensity_) ||
          is_it(color_)) {
        continue;
      }
      raw_fields_.push_back(field);
    }
    about_ = columns.about();
    if (!header_.viewpoint.empty()) {
      about_.notes.push_back(
          fmt::format("its VIEWPOINT {} is not applied: points stay as they are in the file",
                      header_.viewpoint));
    }
  }

  void check_binary_length() const {
    const std::uint64_t present = file_.bytes().size() - header_.data_offset;
    if (header_.points > present / header_.point_size) {
      throw InputError(fmt::format(
          "{}: byte {}: the header promises {} points of {} bytes, the file has {} of them; it is "
          "cut off or its header is wrong",
          file_.path(),
          file_.bytes().size(),
          header_.points,
          header_.point_size,
          present / header_.point_size));
    }
  }

  // two sizes, then LZF data: all x, then all y, ...
  void decompress() {
    const auto bytes = file_.bytes().subspan(header_.data_offset);
    const auto fail = [&](const std::string& what) {
      throw InputError(fmt::format("{}: byte {}: {}", file_.path(), header_.data_offset, what));
    };
    if (bytes.size() < 8) fail("cut off before the sizes of the compressed data");
    const std::uint64_t packed = load<std::uint32_t>(bytes.data());
    const std::uint64_t unpacked = load<std::uint32_t>(bytes.data() + 4);
    if (packed > bytes.size() - 8) {
      fail(fmt::format("{} compressed bytes are promised, {} are there; the file is cut off",
                       packed,
                       bytes.size() - 8));
    }
    // 3 bytes of LZF make at most 264
    if (unpacked > packed * 88 + 264) fail("the unpacked size is impossible; the file is corrupt");
    if (header_.points > unpacked / header_.point_size) {
      fail(fmt::format("the header promises {} points of {} bytes, the data unpacks to {} bytes",
                       header_.points,
                       header_.point_size,
                       unpacked));
    }
    unpacked_.resize(unpacked);
    const unsigned got = unpacked == 0 ? 0
                                       : lzf_decompress(bytes.data() + 8,
                                                        static_cast<unsigned>(packed),
                                                        unpacked_.data(),
                                                        static_cast<unsigned>(unpacked));
    if (got != unpacked) fail("the compressed data is corrupt");
    for (PcdColumn* field : {&position_[0], &position_[1], &position_[2]}) to_columns(*field);
    if (intensity_) to_columns(*intensity_);
    if (color_) to_columns(*color_);
    if (time_) to_columns(*time_);
    if (ring_) to_columns(*ring_);
    for (PcdColumn& field : raw_fields_) to_columns(field);
  }

  /// In unpacked data `offset` is where the field's column starts.
  void to_columns(PcdColumn& field) const { field.offset *= header_.points; }

  [[nodiscard]] const std::byte* place_of(std::uint64_t point, const PcdColumn& field) const {
    if (header_.encoding == PcdEncoding::kBinaryCompressed) {
      return unpacked_.data() + field.offset + point * field.size * field.count;
    }
    return file_.bytes().data() + header_.data_offset + point * header_.point_size + field.offset;
  }

  [[nodiscard]] double binary_number(std::uint64_t point, const PcdColumn& field) const {
    return load_number(place_of(point, field), field.type, field.size);
  }

  /// Colours are the low 24 bits of a whole number, which PCL also writes as a float of these bits.
  static std::array<std::uint8_t, 3> unpack_color(std::uint32_t bits) {
    const auto part = [bits](int shift) { return static_cast<std::uint8_t>(bits >> shift); };
    return {part(16), part(8), part(0)};
  }
  [[nodiscard]] std::uint32_t color_bits(double value) const {
    if (color_->type == 'F') return std::bit_cast<std::uint32_t>(static_cast<float>(value));
    return value >= 0.0 && value <= 4294967295.0 ? static_cast<std::uint32_t>(value) : 0;
  }

  /// Drivers write seconds (Velodyne: time, RoboSense: timestamp), nanoseconds as whole numbers
  /// (Ouster: t, Livox: offset_time) or as doubles since 1970 (Livox: timestamp).
  [[nodiscard]] double seconds_of(double value) {
    constexpr double kSecondsEnd = 1e11;  // the year 5138
    const bool is_nanoseconds = time_->type != 'F' || std::abs(value) > kSecondsEnd;
    time_unit_ = is_nanoseconds ? 1e-9 : 1.0;
    return time_unit_ * value;
  }

  /// -1 if it is none.
  static std::int32_t ring_of(double value) {
    return value >= 0.0 && value < 65536.0 ? static_cast<std::int32_t>(value) : -1;
  }

  void read_binary(std::uint64_t count, std::vector<CloudPoint>& batch) {
    batch.resize(count);
    for (std::uint64_t i = 0; i < count; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        batch[i].position[static_cast<int>(axis)] = binary_number(next_ + i, position_[axis]);
      }
      if (intensity_)
        batch[i].intensity = static_cast<float>(binary_number(next_ + i, *intensity_));
      if (color_) {
        batch[i].color = unpack_color(load<std::uint32_t>(place_of(next_ + i, *color_)));
      }
      if (time_) times_.push_back(seconds_of(binary_number(next_ + i, *time_)));
      if (ring_) rings_.push_back(ring_of(binary_number(next_ + i, *ring_)));
      if (!keeps_raw_) continue;
      for (const PcdColumn& field : raw_fields_) {
        const std::byte* at = place_of(next_ + i, field);
        raw_.insert(raw_.end(), at, at + field.size);
      }
    }
    if (header_.encoding == PcdEncoding::kBinary) {
      file_.release_before(header_.data_offset + (next_ + count) * header_.point_size);
    }
  }

  void read_ascii(std::uint64_t count, std::vector<CloudPoint>& batch) {
    std::string_view line;
    while (batch.size() < count) {
      if (!lines_->next(line)) {
        throw InputError(fmt::format("{}:{}: the header promises {} points, the file has {}",
                                     file_.path(),
                                     header_.data_line + lines_->number(),
                                     header_.points,
                                     next_ + batch.size()));
      }
      if (line.empty()) continue;
      words_.clear();
      texts_.clear();
      for (auto word = take_word(line); !word.empty(); word = take_word(line)) {
        double value = 0.0;
        if (!parse_number(word, value)) fail_line(fmt::format("'{}' is no number", excerpt(word)));
        words_.push_back(value);
        texts_.push_back(word);
      }
      if (words_.size() != header_.columns) {
        fail_line(
            fmt::format("{} numbers where the header has {}", words_.size(), header_.columns));
      }
      CloudPoint& point = batch.emplace_back();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        point.position[static_cast<int>(axis)] = words_[position_[axis].offset];
      }
      if (intensity_) point.intensity = static_cast<float>(words_[intensity_->offset]);
      if (color_) point.color = unpack_color(color_bits(words_[color_->offset]));
      if (time_) times_.push_back(seconds_of(words_[time_->offset]));
      if (ring_) rings_.push_back(ring_of(words_[ring_->offset]));
      if (!keeps_raw_) continue;
      for (const PcdColumn& field : raw_fields_) keep_raw_text(field);
    }
  }

  /// Whole numbers of 64 bits have more digits than a double.
  void keep_raw_text(const PcdColumn& field) {
    const auto keep = [&](auto value) {
      const auto* bytes = reinterpret_cast<const std::byte*>(&value);
      raw_.insert(raw_.end(), bytes, bytes + field.size);
    };
    const std::string_view text = texts_[field.offset];
    const double number = words_[field.offset];
    if (field.type == 'F' && field.size == 4) return keep(static_cast<float>(number));
    if (field.type == 'F') return keep(number);
    std::int64_t whole = 0;
    std::uint64_t natural = 0;
    const char* end = text.data() + text.size();
    if (std::from_chars(text.data(), end, natural).ptr == end) return keep(natural);
    if (std::from_chars(text.data(), end, whole).ptr == end) return keep(whole);
    keep(std::abs(number) < 9e18 ? static_cast<std::int64_t>(number) : 0);
  }

  [[noreturn]] void fail_line(const std::string& what) const {
    throw InputError(
        fmt::format("{}:{}: {}", file_.path(), header_.data_line + lines_->number(), what));
  }

  MappedFile file_;
  PcdHeader header_;
  FileColumns about_;
  std::array<PcdColumn, 3> position_;
  std::optional<PcdColumn> intensity_;
  std::optional<PcdColumn> color_;
  std::optional<PcdColumn> time_;
  std::optional<PcdColumn> ring_;
  std::optional<LineCursor> lines_;
  std::vector<std::byte> unpacked_;
  std::vector<PcdColumn> raw_fields_;
  bool keeps_raw_ = false;
  std::vector<std::byte> raw_;
  std::vector<double> words_;
  std::vector<std::string_view> texts_;
  std::vector<double> times_;
  std::vector<std::int32_t> rings_;
  double time_unit_ = 1.0;
  std::uint64_t next_ = 0;
};

}  // namespace

std::unique_ptr<CloudReader> open_pcd(MappedFile file) {
  return std::make_unique<PcdReader>(std::move(file));
}

}  // namespace pointflight
