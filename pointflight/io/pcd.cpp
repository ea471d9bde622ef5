#include <fmt/format.h>
#include <liblzf/lzf.h>

#include <algorithm>
#include <array>
#include <bit>
#include <optional>

#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/file_unit.hpp"
#include "pointflight/io/formats.hpp"

// PCD 0.7 as documented by the Point Cloud Library, "The PCD (Point Cloud Data) file format".
namespace pointflight {
namespace {

struct Field {
  std::string name;
  std::size_t size = 4;
  char type = 'F';
  std::size_t count = 1;
  std::size_t offset = 0;  ///< Bytes from the start of a point; column index in ascii files.
};

enum class Encoding { kAscii, kBinary, kBinaryCompressed };

struct Header {
  std::vector<Field> fields;
  std::uint64_t points = 0;
  bool has_points = false;
  Encoding encoding = Encoding::kAscii;
  std::size_t point_size = 0;
  std::size_t columns = 0;
  std::size_t data_offset = 0;
  std::size_t data_line = 0;
  std::optional<FileUnit> unit;
};

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

class HeaderParser {
 public:
  explicit HeaderParser(const MappedFile& file) : file_(file), lines_(as_text(file.bytes())) {}

  Header parse() {
    std::string_view line;
    while (lines_.next(line)) {
      const std::string_view key = take_word(line);
      if (!key.empty() && key.front() == '#' && !header_.unit) header_.unit = unit_in_comment(line);
      if (key.empty() || key.front() == '#' || key == "VERSION" || key == "VIEWPOINT") continue;
      if (key == "FIELDS" || key == "COLUMNS") {
        parse_fields(line);
      } else if (key == "SIZE") {
        integers(line, "SIZE", 1, 8, sizes_);
      } else if (key == "TYPE") {
        types_.clear();
        for (auto word = take_word(line); !word.empty(); word = take_word(line)) {
          types_.push_back(parse_type(word));
        }
      } else if (key == "COUNT") {
        integers(line, "COUNT", 0, 1 << 20, counts_);
      } else if (key == "WIDTH") {
        width_ = integer(line, "WIDTH", 0, kMaxPoints);
      } else if (key == "HEIGHT") {
        height_ = integer(line, "HEIGHT", 0, kMaxPoints);
      } else if (key == "POINTS") {
        header_.points = integer(line, "POINTS", 0, kMaxPoints);
        header_.has_points = true;
      } else if (key == "DATA") {
        parse_encoding(take_word(line));
        finish();
        return header_;
      } else {
        fail(fmt::format("'{}' is not a PCD header key; is this a PCD file?", excerpt(key)));
      }
      if (lines_.number() > 100) fail("no DATA line within 100 lines; is this a PCD file?");
    }
    fail("the header has no DATA line; the file is cut off or not a PCD file");
  }

 private:
  static constexpr std::uint64_t kMaxPoints = std::uint64_t{1} << 40;

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}: {}", file_.path(), lines_.number(), what));
  }

  std::uint64_t integer(std::string_view& line,
                        std::string_view key,
                        std::uint64_t min,
                        std::uint64_t max) {
    const std::string_view word = take_word(line);
    double value = 0.0;
    if (!parse_number(word, value) || !(value >= static_cast<double>(min)) ||
        !(value <= static_cast<double>(max)) ||
        value != static_cast<double>(static_cast<std::uint64_t>(value))) {
      fail(fmt::format("{} wants a whole number from {} to {} for each field, found '{}'",
                       key,
                       min,
                       max,
                       excerpt(word)));
    }
    return static_cast<std::uint64_t>(value);
  }

  void integers(std::string_view line,
                std::string_view key,
                std::uint64_t min,
                std::uint64_t max,
                std::vector<std::uint64_t>& values) {
    values.clear();
    while (line.find_first_not_of(" \t") != std::string_view::npos) {
      values.push_back(integer(line, key, min, max));
    }
  }

  /// SIZE, TYPE and COUNT may stand before or after FIELDS.
  void apply_to_fields() {
    const auto check = [&](std::string_view key, std::size_t found, bool required) {
      if (found != header_.fields.size() && (found != 0 || required)) {
        fail(fmt::format("{} has {} values for {} FIELDS", key, found, header_.fields.size()));
      }
    };
    const bool binary = header_.encoding != Encoding::kAscii;
    check("SIZE", sizes_.size(), binary);
    check("TYPE", types_.size(), binary);
    check("COUNT", counts_.size(), false);
    for (std::size_t i = 0; i < header_.fields.size(); ++i) {
      if (!sizes_.empty()) header_.fields[i].size = sizes_[i];
      if (!types_.empty()) header_.fields[i].type = types_[i];
      if (!counts_.empty()) header_.fields[i].count = counts_[i];
    }
  }

  void parse_fields(std::string_view line) {
    header_.fields.clear();
    for (auto name = take_word(line); !name.empty(); name = take_word(line)) {
      header_.fields.emplace_back().name = std::string(name);
    }
    if (header_.fields.size() > 1000) fail("more than 1000 fields; is this a PCD file?");
  }

  char parse_type(std::string_view word) {
    if (word != "F" && word != "I" && word != "U") {
      fail(fmt::format("TYPE '{}' is unknown; F, I or U for each field", excerpt(word)));
    }
    return word.front();
  }

  void parse_encoding(std::string_view word) {
    if (word == "ascii") {
      header_.encoding = Encoding::kAscii;
    } else if (word == "binary") {
      header_.encoding = Encoding::kBinary;
    } else if (word == "binary_compressed") {
      header_.encoding = Encoding::kBinaryCompressed;
    } else {
      fail(fmt::format("DATA '{}' is unknown; ascii, binary or binary_compressed", excerpt(word)));
    }
  }

  void finish() {
    apply_to_fields();
    for (Field& field : header_.fields) {
      if (field.type == 'F' && field.size != 4 && field.size != 8) {
        fail(fmt::format("field '{}': a float of {} bytes; 4 or 8", field.name, field.size));
      }
      if (field.size != 1 && field.size != 2 && field.size != 4 && field.size != 8) {
        fail(fmt::format(
            "field '{}': an integer of {} bytes; 1, 2, 4 or 8", field.name, field.size));
      }
      field.offset = header_.encoding == Encoding::kAscii ? header_.columns : header_.point_size;
      header_.columns += field.count;
      header_.point_size += field.size * field.count;
    }
    if (!header_.has_points) {
      height_ = std::max<std::uint64_t>(height_, 1);
      if (width_ > kMaxPoints / height_) {
        fail(fmt::format("WIDTH {} times HEIGHT {} is no number of points", width_, height_));
      }
      header_.points = width_ * height_;
    }
    header_.data_offset = lines_.offset();
    header_.data_line = lines_.number();
  }

  const MappedFile& file_;
  LineCursor lines_;
  Header header_;
  std::vector<std::uint64_t> sizes_;
  std::vector<char> types_;
  std::vector<std::uint64_t> counts_;
  std::uint64_t width_ = 0;
  std::uint64_t height_ = 1;
};

class PcdReader : public CloudReader {
 public:
  explicit PcdReader(MappedFile file)
      : file_(std::move(file)), header_(HeaderParser(file_).parse()) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string name(1, "xyz"[axis]);
      const Field* field = find(name);
      if (field == nullptr) {
        throw InputError(fmt::format(
            "{}: no field '{}' in the PCD header; x, y and z are needed", file_.path(), name));
      }
      position_[axis] = *field;
    }
    if (const Field* field = find("intensity")) intensity_ = *field;
    for (const char* name : {"rgb", "rgba"}) {
      const Field* field = find(name);
      if (field != nullptr && field->size == 4) color_ = *field;
    }
    if (header_.encoding == Encoding::kAscii) {
      lines_.emplace(as_text(file_.bytes()).substr(header_.data_offset));
    } else if (header_.encoding == Encoding::kBinary) {
      check_binary_length();
    } else {
      decompress();
    }
    file_.will_read_sequentially();
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    const std::uint64_t count = std::min<std::uint64_t>(kBatch, header_.points - next_);
    if (header_.encoding == Encoding::kAscii) {
      read_ascii(count, batch);
    } else {
      read_binary(count, batch);
    }
    next_ += batch.size();
    return !batch.empty();
  }

  [[nodiscard]] bool has_intensity() const override { return intensity_.has_value(); }
  [[nodiscard]] bool has_color() const override { return color_.has_value(); }
  [[nodiscard]] std::optional<FileUnit> unit() const override { return header_.unit; }
  [[nodiscard]] double share_read() const override {
    return header_.points == 0 ? 1.0
                               : static_cast<double>(next_) / static_cast<double>(header_.points);
  }

 private:
  [[nodiscard]] const Field* find(const std::string& name) const {
    for (const Field& field : header_.fields) {
      if (field.name == name && field.count > 0) return &field;
    }
    return nullptr;
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
    for (Field* field : {&position_[0], &position_[1], &position_[2]}) to_columns(*field);
    if (intensity_) to_columns(*intensity_);
    if (color_) to_columns(*color_);
  }

  /// In unpacked data `offset` is where the field's column starts.
  void to_columns(Field& field) const { field.offset *= header_.points; }

  [[nodiscard]] const std::byte* place_of(std::uint64_t point, const Field& field) const {
    if (header_.encoding == Encoding::kBinaryCompressed) {
      return unpacked_.data() + field.offset + point * field.size * field.count;
    }
    return file_.bytes().data() + header_.data_offset + point * header_.point_size + field.offset;
  }

  [[nodiscard]] double binary_number(std::uint64_t point, const Field& field) const {
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

  void read_binary(std::uint64_t count, std::vector<CloudPoint>& batch) const {
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
    }
    if (header_.encoding == Encoding::kBinary) {
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
      for (auto word = take_word(line); !word.empty(); word = take_word(line)) {
        double value = 0.0;
        if (!parse_number(word, value)) fail_line(fmt::format("'{}' is no number", excerpt(word)));
        words_.push_back(value);
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
    }
  }

  [[noreturn]] void fail_line(const std::string& what) const {
    throw InputError(
        fmt::format("{}:{}: {}", file_.path(), header_.data_line + lines_->number(), what));
  }

  MappedFile file_;
  Header header_;
  std::array<Field, 3> position_;
  std::optional<Field> intensity_;
  std::optional<Field> color_;
  std::optional<LineCursor> lines_;
  std::vector<std::byte> unpacked_;
  std::vector<double> words_;
  std::uint64_t next_ = 0;
};

}  // namespace

std::unique_ptr<CloudReader> open_pcd(MappedFile file) {
  return std::make_unique<PcdReader>(std::move(file));
}

}  // namespace pointflight
