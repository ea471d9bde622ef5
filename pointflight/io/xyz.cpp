#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>

#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/formats.hpp"

namespace pointflight {
namespace {

bool is_comment(std::string_view line) {
  const std::size_t begin = line.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return true;
  return line[begin] == '#' || line.substr(begin, 2) == "//";
}

std::string lower(std::string_view word) {
  std::string text(word);
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  while (!text.empty() && (text.front() == '"' || text.front() == '/')) text.erase(0, 1);
  while (!text.empty() && text.back() == '"') text.pop_back();
  return text;
}

class XyzReader : public CloudReader {
 public:
  explicit XyzReader(MappedFile file) : file_(std::move(file)), lines_(as_text(file_.bytes())) {
    find_columns();
    file_.will_read_sequentially();
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    std::string_view line;
    while (batch.size() < kBatch && lines_.next(line)) {
      if (is_comment(line)) continue;
      parse_line(line);
      if (words_.size() == 1 && first_row_) {  // PTS: the number of points
        first_row_ = false;
        continue;
      }
      first_row_ = false;
      const std::size_t wanted = 1 + std::max({position_[0], position_[1], position_[2]});
      if (words_.size() < wanted) {
        fail(fmt::format("{} numbers; at least {} for x y z", words_.size(), wanted));
      }
      CloudPoint& point = batch.emplace_back();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        point.position[static_cast<int>(axis)] = words_[position_[axis]];
      }
      if (intensity_ && *intensity_ < words_.size()) {
        point.intensity = static_cast<float>(words_[*intensity_]);
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

  void parse_line(std::string_view line) {
    words_.clear();
    for (auto word = take_word(line); !word.empty(); word = take_word(line)) {
      double value = 0.0;
      if (!parse_number(word, value)) {
        fail(fmt::format("'{}' is no number; lines of x y z [intensity] are expected",
                         excerpt(word)));
      }
      words_.push_back(value);
    }
  }

  /// A line of names tells the columns; without one, 4 or 7 columns have an intensity in the
  /// fourth.
  void find_columns() {
    LineCursor ahead(as_text(file_.bytes()));
    std::string_view line;
    std::size_t columns = 0;
    while (ahead.next(line)) {
      if (is_comment(line)) continue;
      std::vector<std::string> names;
      std::string_view rest = line;
      double ignored = 0.0;
      bool numeric = true;
      for (auto word = take_word(rest); !word.empty(); word = take_word(rest)) {
        numeric = numeric && parse_number(word, ignored);
        names.push_back(lower(word));
      }
      if (!numeric) {
        lines_ = ahead;  // data starts after the names
        use_names(names, ahead.number());
        return;
      }
      columns = names.size();
      if (columns > 1) break;
    }
    if (columns == 4 || columns == 7) intensity_ = 3;
  }

  void use_names(const std::vector<std::string>& names, std::size_t line) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto found = std::find(names.begin(), names.end(), std::string(1, "xyz"[axis]));
      if (found == names.end()) {
        throw InputError(fmt::format(
            "{}:{}: neither numbers nor column names with x, y and z; is this a text cloud?",
            file_.path(),
            line));
      }
      position_[axis] = static_cast<std::size_t>(found - names.begin());
    }
    for (const char* name : {"intensity", "i", "reflectance", "scalar_intensity"}) {
      const auto found = std::find(names.begin(), names.end(), name);
      if (found != names.end()) {
        intensity_ = static_cast<std::size_t>(found - names.begin());
        return;
      }
    }
  }

  MappedFile file_;
  LineCursor lines_;
  std::array<std::size_t, 3> position_{0, 1, 2};
  std::optional<std::size_t> intensity_;
  std::vector<double> words_;
  bool first_row_ = true;
};

}  // namespace

std::unique_ptr<CloudReader> open_xyz(MappedFile file) {
  return std::make_unique<XyzReader>(std::move(file));
}

}  // namespace pointflight
