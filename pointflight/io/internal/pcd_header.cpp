#include "pointflight/io/internal/pcd_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/formats.hpp"

namespace pointflight {
namespace {

class PcdHeaderParser {
 public:
  explicit PcdHeaderParser(const MappedFile& file) : file_(file), lines_(as_text(file.bytes())) {}

  PcdHeader parse() {
    std::string_view line;
    while (lines_.next(line)) {
      const std::string_view key = take_word(line);
      if (!key.empty() && key.front() == '#' && !header_.unit) header_.unit = unit_in_comment(line);
      if (key.empty() || key.front() == '#' || key == "VERSION") continue;
      if (key == "VIEWPOINT") {
        parse_viewpoint(line);
      } else if (key == "FIELDS" || key == "COLUMNS") {
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
    const bool binary = header_.encoding != PcdEncoding::kAscii;
    check("SIZE", sizes_.size(), binary);
    check("TYPE", types_.size(), binary);
    check("COUNT", counts_.size(), false);
    for (std::size_t i = 0; i < header_.fields.size(); ++i) {
      if (!sizes_.empty()) header_.fields[i].size = sizes_[i];
      if (!types_.empty()) header_.fields[i].type = types_[i];
      if (!counts_.empty()) header_.fields[i].count = counts_[i];
    }
  }

  /// Where the sensor was: position and quaternion w x y z.
  void parse_viewpoint(std::string_view line) {
    constexpr std::array<double, 7> kIdentity = {0, 0, 0, 1, 0, 0, 0};
    const std::string_view text = line.substr(std::min(line.size(), line.find_first_not_of(" \t")));
    for (const double wanted : kIdentity) {
      double value = 0.0;
      const std::string_view word = take_word(line);
      if (!word.empty() && parse_number(word, value) && value == wanted) continue;
      header_.viewpoint = excerpt(text);
      return;
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
    const std::size_t type = std::string_view("FIUfiu").find(word);
    if (word.size() != 1 || type == std::string_view::npos) {
      fail(fmt::format("TYPE '{}' is unknown; F, I or U for each field", excerpt(word)));
    }
    return "FIU"[type % 3];
  }

  void parse_encoding(std::string_view word) {
    if (word == "ascii") {
      header_.encoding = PcdEncoding::kAscii;
    } else if (word == "binary") {
      header_.encoding = PcdEncoding::kBinary;
    } else if (word == "binary_compressed") {
      header_.encoding = PcdEncoding::kBinaryCompressed;
    } else {
      fail(fmt::format("DATA '{}' is unknown; ascii, binary or binary_compressed", excerpt(word)));
    }
  }

  void finish() {
    apply_to_fields();
    for (PcdColumn& field : header_.fields) {
      if (field.type == 'F' && field.size != 4 && field.size != 8) {
        fail(fmt::format("field '{}': a float of {} bytes; 4 or 8", field.name, field.size));
      }
      if (field.size != 1 && field.size != 2 && field.size != 4 && field.size != 8) {
        fail(fmt::format(
            "field '{}': an integer of {} bytes; 1, 2, 4 or 8", field.name, field.size));
      }
      field.offset = header_.encoding == PcdEncoding::kAscii ? header_.columns : header_.point_size;
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
    header_.width = width_;
    header_.height = height_;
    header_.data_offset = lines_.offset();
    header_.data_line = lines_.number();
  }

  const MappedFile& file_;
  LineCursor lines_;
  PcdHeader header_;
  std::vector<std::uint64_t> sizes_;
  std::vector<char> types_;
  std::vector<std::uint64_t> counts_;
  std::uint64_t width_ = 0;
  std::uint64_t height_ = 1;
};

}  // namespace

PcdHeader parse_pcd_header(const MappedFile& file) {
  return PcdHeaderParser(file).parse();
}

}  // namespace pointflight
