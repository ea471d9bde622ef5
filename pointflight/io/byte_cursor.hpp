#pragma once

#include <fmt/format.h>

#include <bit>
#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <string_view>

#include "pointflight/core/input_error.hpp"

namespace pointflight {

/// Reads a little- or big-endian number from unaligned bytes. The caller has checked the length.
template <class T>
T load(const std::byte* bytes, bool big_endian = false) {
  std::byte copy[sizeof(T)];
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    copy[i] = bytes[big_endian ? sizeof(T) - 1 - i : i];
  }
  T value{};
  std::memcpy(&value, copy, sizeof(T));
  return value;
}
static_assert(std::endian::native == std::endian::little);

/// Walks over the lines of a text in memory and knows the line number.
class LineCursor {
 public:
  /// `text` must outlive the cursor and the lines.
  explicit LineCursor(std::string_view text) : text_(text) {}

  /// The next line without its end ("\n" or "\r\n"). False at the end of the text.
  bool next(std::string_view& line) {
    if (offset_ >= text_.size()) return false;
    const std::size_t end = text_.find('\n', offset_);
    const std::size_t stop = end == std::string_view::npos ? text_.size() : end;
    line = text_.substr(offset_, stop - offset_);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    offset_ = stop + 1;
    ++number_;
    return true;
  }

  /// Bytes up to the end of the last line that was given.
  [[nodiscard]] std::size_t offset() const {
    return offset_ < text_.size() ? offset_ : text_.size();
  }
  /// Of the last line that was given, from 1; 0 before the first.
  [[nodiscard]] std::size_t number() const { return number_; }
  /// Of the text that was gone through, 0 to 1.
  [[nodiscard]] double share() const {
    return text_.empty() ? 1.0 : static_cast<double>(offset()) / static_cast<double>(text_.size());
  }

 private:
  std::string_view text_;
  std::size_t offset_ = 0;
  std::size_t number_ = 0;
};

/// Takes the next word off the front of `line`; words end at blanks, commas, semicolons or tabs.
inline std::string_view take_word(std::string_view& line) {
  constexpr std::string_view kSeparators = " \t,;";
  const std::size_t begin = line.find_first_not_of(kSeparators);
  if (begin == std::string_view::npos) {
    line = {};
    return {};
  }
  std::size_t end = line.find_first_of(kSeparators, begin);
  if (end == std::string_view::npos) end = line.size();
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

/// Parses a number; "nan", "inf" and a leading '+' are numbers too. False if `word` is not one.
bool parse_number(std::string_view word, double& value);

/// ASCII letters in lower case.
std::string lower_case(std::string_view text);

/// A file's bytes as text.
inline std::string_view as_text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Printable excerpt of hostile text for a message: its first characters.
std::string excerpt(std::string_view text, std::size_t length = 40);

}  // namespace pointflight
