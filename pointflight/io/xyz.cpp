#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <limits>
#include <optional>

#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/formats.hpp"

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

std::string lower(std::string_view word) {
  std::string text(word);
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// The text without the byte-order mark that some editors put first.
std::string_view without_mark(std::string_view text) {
  return text.substr(text.substr(0, 3) == "\xef\xbb\xbf" ? 3 : 0);
}

class XyzReader : public CloudReader {
 public:
  explicit XyzReader(MappedFile file)
      : file_(std::move(file)), lines_(without_mark(as_text(file_.bytes()))) {
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
    }
    file_.release_before(lines_.offset());
    return !batch.empty();
  }

  [[nodiscard]] bool has_intensity() const override { return intensity_.has_value(); }
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

  /// A line of names, commented out or not, tells the columns; without one, 4 or 7 columns have an
  /// intensity in the fourth.
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
        if (fields_.size() == 4 || fields_.size() == 7) intensity_ = 3;
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
      names.push_back(lower(field.substr(std::min(field.size(), field.find_first_not_of("/")))));
    }
    return names;
  }

  /// False if x, y or z is missing.
  bool use_names(const std::vector<std::string>& names) {
    std::array<std::size_t, 3> position{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto found = std::find(names.begin(), names.end(), std::string(1, "xyz"[axis]));
      if (found == names.end()) return false;
      position[axis] = static_cast<std::size_t>(found - names.begin());
    }
    position_ = position;
    for (const char* name : {"intensity", "i", "reflectance", "scalar_intensity"}) {
      const auto found = std::find(names.begin(), names.end(), name);
      if (found == names.end()) continue;
      intensity_ = static_cast<std::size_t>(found - names.begin());
      break;
    }
    return true;
  }

  MappedFile file_;
  LineCursor lines_;
  std::array<std::size_t, 3> position_{0, 1, 2};
  std::optional<std::size_t> intensity_;
  std::vector<std::string_view> fields_;
};

}  // namespace

std::unique_ptr<CloudReader> open_xyz(MappedFile file) {
  return std::make_unique<XyzReader>(std::move(file));
}

}  // namespace pointflight
