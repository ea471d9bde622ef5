#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/formats.hpp"
#include "pointflight/io/internal/column_names.hpp"

namespace pointflight {
namespace {

constexpr std::string_view kBlanks = " \t\"\r";

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

bool is_comment(std::string_view line) {
  const std::string_view text = trimmed(line);
  return text.empty() || text.front() == '#' || text.substr(0, 2) == "//";
}

/// Fields of a line. Where it has semicolons or commas each of them ends a field, which may be
/// empty; else blanks do.
void split(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  line = trimmed(line.substr(0, line.find('#')));
  const bool has_semicolon = line.find(';') != std::string_view::npos;
  if (!has_semicolon && line.find(',') == std::string_view::npos) {
    for (auto word = take_word(line); !word.empty(); word = take_word(line)) {
      fields.push_back(trimmed(word));
    }
    return;
  }
  const char separator = has_semicolon ? ';' : ',';
  for (;;) {
    const std::size_t end = line.find(separator);
    fields.push_back(trimmed(line.substr(0, end)));
    if (end == std::string_view::npos) return;
    line.remove_prefix(end + 1);
  }
}

/// The text without the byte-order mark that some editors put first.
std::string_view without_mark(std::string_view text) {
  return text.substr(text.substr(0, 3) == "\xef\xbb\xbf" ? 3 : 0);
}

constexpr std::size_t kLooks = 1000;  // rows that tell what columns without names are

/// What columns without names hold, by how many there are and what stands in them.
enum class Unnamed {
  kIntensity,       ///< x y z intensity
  kIntensityColor,  ///< x y z intensity red green blue, as PTS files have them
  kColor,           ///< x y z red green blue
  kColorIntensity,  ///< x y z red green blue intensity
  kNothing,         ///< x y z, and what nobody knows
};

std::vector<std::string> names_of(Unnamed columns) {
  switch (columns) {
    case Unnamed::kIntensity:
      return {"x", "y", "z", "intensity"};
    case Unnamed::kIntensityColor:
      return {"x", "y", "z", "intensity", "red", "green", "blue"};
    case Unnamed::kColor:
      return {"x", "y", "z", "red", "green", "blue"};
    case Unnamed::kColorIntensity:
      return {"x", "y", "z", "red", "green", "blue", "intensity"};
    default:
      return {"x", "y", "z"};
  }
}

class XyzReader : public CloudReader {
 public:
  XyzReader(MappedFile file, bool is_pts)
      : file_(std::move(file)), is_pts_(is_pts), lines_(without_mark(as_text(file_.bytes()))) {
    find_columns();
    file_.will_read_sequentially();
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    std::string_view line;
    while (batch.size() < kBatch && lines_.next(line)) {
      if (is_comment(line)) continue;
      split(line, fields_);
      if (is_point_count()) continue;
      const std::size_t wanted = 1 + std::max({position_[0], position_[1], position_[2]});
      if (fields_.size() < wanted) {
        fail(fmt::format("{} columns; at least {} for x y z", fields_.size(), wanted));
      }
      CloudPoint& point = batch.emplace_back();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        point.position[static_cast<int>(axis)] = number(fields_[position_[axis]]);
      }
      if (intensity_ && *intensity_ < fields_.size()) {
        point.intensity = static_cast<float>(number(fields_[*intensity_]));
      }
      for (std::size_t c = 0; c < 3 && has_color_; ++c) {
        if (color_[c] < fields_.size()) point.color[c] = color_part(number(fields_[color_[c]]));
      }
    }
    file_.release_before(lines_.offset());
    return !batch.empty();
  }

  [[nodiscard]] bool has_intensity() const override { return intensity_.has_value(); }
  [[nodiscard]] bool has_color() const override { return has_color_; }
  [[nodiscard]] FileColumns columns() const override { return about_; }
  [[nodiscard]] double share_read() const override { return lines_.share(); }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}: {}", file_.path(), lines_.number(), what));
  }

  /// An empty field is NaN: the point is counted and dropped.
  [[nodiscard]] double number(std::string_view field) const {
    double value = std::numeric_limits<double>::quiet_NaN();
    if (!field.empty() && !parse_number(field, value)) {
      fail(
          fmt::format("'{}' is no number; lines of x y z [intensity] with decimal points are "
                      "expected",
                      excerpt(field)));
    }
    return value;
  }

  /// PTS files give the number of points before each scan, alone on a line.
  [[nodiscard]] bool is_point_count() const {
    return fields_.size() == 1 && !fields_.front().empty() &&
           fields_.front().find_first_not_of("0123456789") == std::string_view::npos;
  }

  static std::uint8_t color_part(double value) {
    return value > 0.0 ? static_cast<std::uint8_t>(std::min(value + 0.5, 255.0)) : std::uint8_t{0};
  }

  /// A line of names, commented out or not, tells the columns; without one, what stands in them.
  void find_columns() {
    LineCursor ahead = lines_;
    std::string_view line;
    std::vector<std::string> comment;
    while (ahead.next(line)) {
      if (is_comment(line)) {
        const std::string_view text = trimmed(line);
        const std::size_t begin = text.find_first_not_of("#/");
        comment = begin == std::string_view::npos ? std::vector<std::string>()
                                                  : names_in(text.substr(begin));
        continue;
      }
      split(line, fields_);
      if (is_point_count()) continue;
      const auto is_name = [](std::string_view field) {
        double ignored = 0.0;
        return !parse_number(field, ignored);
      };
      const auto first_three = fields_.begin() + std::min<std::ptrdiff_t>(3, std::ssize(fields_));
      if (std::any_of(fields_.begin(), first_three, is_name)) {
        lines_ = ahead;  // data starts after the names
        if (!use_names(names_in(line))) {
          fail("neither numbers nor column names with x, y and z; is this a text cloud?");
        }
      } else if (comment.size() != fields_.size() || !use_names(comment)) {
        guess_columns(fields_.size());
      }
      return;
    }
  }

  static std::vector<std::string> names_in(std::string_view line) {
    std::vector<std::string_view> fields;
    split(line, fields);
    std::vector<std::string> names;
    names.reserve(fields.size());
    for (const std::string_view field : fields) {
      names.emplace_back(field.substr(std::min(field.size(), field.find_first_not_of("/"))));
    }
    return names;
  }

  /// False if x, y or z is missing.
  bool use_names(const std::vector<std::string>& names) {
    const NamedColumns columns(names);
    if (!columns.has_position()) return false;
    has_color_ = columns.has_color();
    for (std::size_t i = 0; i < 3; ++i) {
      position_[i] = columns.at(static_cast<ColumnRole>(i));
      constexpr std::array kParts = {ColumnRole::kRed, ColumnRole::kGreen, ColumnRole::kBlue};
      if (has_color_) color_[i] = columns.at(kParts[i]);
    }
    intensity_ = columns.find(ColumnRole::kIntensity);
    about_ = columns.about();
    return true;
  }

  /// The first rows that are not yet read: whether each of three columns is whole and fits a byte.
  [[nodiscard]] bool are_colors(std::size_t first) {
    LineCursor ahead = lines_;
    std::string_view line;
    for (std::size_t rows = 0; rows < kLooks && ahead.next(line);) {
      if (is_comment(line)) continue;
      split(line, fields_);
      if (is_point_count()) continue;
      ++rows;
      for (std::size_t i = first; i < std::min(first + 3, fields_.size()); ++i) {
        double value = -1.0;
        const bool is_whole = parse_number(fields_[i], value) && value == std::floor(value);
        if (!is_whole || value < 0.0 || value > 255.0) return false;
      }
    }
    return true;
  }

  [[nodiscard]] Unnamed unnamed(std::size_t count) {
    if (count == 4) return Unnamed::kIntensity;
    if (count == 6 && are_colors(3)) return Unnamed::kColor;
    if (count != 7) return Unnamed::kNothing;
    if (is_pts_) return Unnamed::kIntensityColor;
    if (are_colors(3)) return Unnamed::kColorIntensity;
    return are_colors(4) ? Unnamed::kIntensityColor : Unnamed::kNothing;
  }

  void guess_columns(std::size_t count) {
    const std::vector<std::string> names = names_of(unnamed(count));
    use_names(names);
    about_.intensity.clear();  // nobody has named it
    if (names.size() < count) {
      about_.notes.push_back(fmt::format(
          "of its {} columns, which have no names, the first 3 are read as x y z; name them in the "
          "first line (x y z intensity ...) if there is more",
          count));
    } else if (names.size() > 3) {
      about_.notes.push_back(fmt::format(
          "its columns have no names; they are read as {}; name them in the first line if this is "
          "not so",
          fmt::join(names, " ")));
    }
  }

  MappedFile file_;
  bool is_pts_;
  LineCursor lines_;
  FileColumns about_;
  std::array<std::size_t, 3> position_{0, 1, 2};
  std::optional<std::size_t> intensity_;
  std::array<std::size_t, 3> color_{};
  bool has_color_ = false;
  std::vector<std::string_view> fields_;
};

}  // namespace

std::unique_ptr<CloudReader> open_xyz(MappedFile file) {
  return std::make_unique<XyzReader>(std::move(file), false);
}

std::unique_ptr<CloudReader> open_pts(MappedFile file) {
  return std::make_unique<XyzReader>(std::move(file), true);
}

}  // namespace pointflight
