#include "pointflight/io/byte_cursor.hpp"

#include <cctype>
#include <charconv>
#include <cstdlib>

namespace pointflight {

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

bool parse_number(std::string_view word, double& value) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const char* end = word.data() + word.size();
  const auto result = std::from_chars(word.data(), end, value);
  if (result.ec == std::errc::result_out_of_range && result.ptr == end) {
    // from_chars does not say which way: infinite above the largest double, nearly zero below
    value = std::strtod(std::string(word).c_str(), nullptr);
    return true;
  }
  return result.ec == std::errc() && result.ptr == end;
}

std::string excerpt(std::string_view text, std::size_t length) {
  std::string shown;
  for (const char c : text.substr(0, length)) shown += c >= ' ' && c <= '~' ? c : '?';
  if (text.size() > length) shown += "...";
  return shown;
}

}  // namespace pointflight
