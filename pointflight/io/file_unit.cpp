#include "pointflight/io/file_unit.hpp"

#include <algorithm>
#include <cctype>
#include <string>

#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {
namespace {

struct NamedUnit {
  std::string_view word;
  std::string_view name;
  double metres;
};

constexpr NamedUnit kUnits[] = {
    {"mm", "millimetre", 0.001},
    {"millimeter", "millimetre", 0.001},
    {"millimetre", "millimetre", 0.001},
    {"cm", "centimetre", 0.01},
    {"centimeter", "centimetre", 0.01},
    {"centimetre", "centimetre", 0.01},
    {"m", "metre", 1.0},
    {"meter", "metre", 1.0},
    {"metre", "metre", 1.0},
    {"km", "kilometre", 1000.0},
    {"kilometer", "kilometre", 1000.0},
    {"kilometre", "kilometre", 1000.0},
    {"in", "inch", 0.0254},
    {"inch", "inch", 0.0254},
    {"inche", "inch", 0.0254},
    {"ft", "foot", 0.3048},
    {"foot", "foot", 0.3048},
    {"feet", "foot", 0.3048},
};

/// The next word of letters, in lower case.
std::string take_letters(std::string_view& text) {
  const auto is_letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  while (!text.empty() && !is_letter(text.front())) text.remove_prefix(1);
  std::string word;
  while (!text.empty() && is_letter(text.front())) {
    word += static_cast<char>(std::tolower(static_cast<unsigned char>(text.front())));
    text.remove_prefix(1);
  }
  return word;
}

std::optional<FileUnit> unit_named(std::string word) {
  for (const bool plural : {false, true}) {
    if (plural && (word.size() < 4 || word.back() != 's')) return std::nullopt;
    if (plural) word.pop_back();
    for (const NamedUnit& unit : kUnits) {
      if (unit.word == word) return FileUnit{std::string(unit.name), unit.metres};
    }
  }
  return std::nullopt;
}

// GeoTIFF 1.1: linear units by their EPSG codes
std::optional<FileUnit> unit_of_code(unsigned code) {
  switch (code) {
    case 9001:
      return FileUnit{"metre", 1.0};
    case 9002:
      return FileUnit{"foot", 0.3048};
    case 9003:
      return FileUnit{"US survey foot", 1200.0 / 3937.0};
    default:
      return std::nullopt;
  }
}

/// GeoTIFF keys: rows of four numbers (key, where, count, value) behind a first row that counts
/// them.
std::optional<FileUnit> unit_in_geo_keys(std::span<const std::byte> keys) {
  constexpr unsigned kModelType = 1024;
  constexpr unsigned kGeographic = 2;
  constexpr unsigned kLinearUnits = 3076;
  constexpr unsigned kVerticalUnits = 4099;
  std::optional<FileUnit> vertical;
  for (std::size_t at = 8; at + 8 <= keys.size(); at += 8) {
    const unsigned key = load<std::uint16_t>(keys.data() + at);
    const unsigned value = load<std::uint16_t>(keys.data() + at + 6);
    if (key == kModelType && value == kGeographic) return FileUnit{"degree", 0.0};
    if (key == kLinearUnits && unit_of_code(value)) return unit_of_code(value);
    if (key == kVerticalUnits) vertical = unit_of_code(value);
  }
  return vertical;
}

/// Well-known text (OGC 01-009): UNIT["name",metres,...] of the projected system stands last in it.
std::optional<FileUnit> unit_in_text(std::string_view text) {
  if (text.find("GEOGCS") != std::string_view::npos &&
      text.find("PROJCS") == std::string_view::npos) {
    return FileUnit{"degree", 0.0};
  }
  std::optional<FileUnit> last;
  constexpr std::string_view kUnit = "UNIT[\"";
  for (std::size_t at = text.find(kUnit); at != std::string_view::npos;
       at = text.find(kUnit, at + 1)) {
    std::string_view rest = text.substr(at + kUnit.size());
    const std::size_t quote = rest.find('"');
    if (quote == std::string_view::npos) break;
    const std::string_view name = rest.substr(0, quote);
    rest.remove_prefix(quote + 1);
    const std::size_t end = rest.find_first_of("],", 1);
    double metres = 0.0;
    if (rest.empty() || end == std::string_view::npos ||
        !parse_number(rest.substr(1, end - 1), metres) || !(metres > 0.0) || !(metres < 1e6)) {
      continue;
    }
    if (name.find("egree") != std::string_view::npos ||
        name.find("adian") != std::string_view::npos) {
      continue;
    }
    last = FileUnit{excerpt(name), metres};
  }
  return last;
}

}  // namespace

std::optional<FileUnit> unit_in_comment(std::string_view comment) {
  while (!comment.empty()) {
    const std::string word = take_letters(comment);
    if (word != "unit" && word != "units") continue;
    std::string next = take_letters(comment);
    if (next == "is" || next == "are" || next == "in" || next == "length") {
      std::string_view ahead = comment;
      const std::string after = take_letters(ahead);
      if (unit_named(after)) next = after;
    }
    return unit_named(next);
  }
  return std::nullopt;
}

std::optional<FileUnit> unit_in_las_records(std::span<const std::byte> records, std::size_t count) {
  constexpr std::size_t kRecordHeader = 54;
  for (; count > 0 && records.size() >= kRecordHeader; --count) {
    const unsigned id = load<std::uint16_t>(records.data() + 18);
    const std::size_t length = load<std::uint16_t>(records.data() + 20);
    if (length > records.size() - kRecordHeader) break;
    const auto body = records.subspan(kRecordHeader, length);
    const bool projection = as_text(records.subspan(2, 15)) == "LASF_Projection";
    std::optional<FileUnit> found;
    if (projection && id == 34735) found = unit_in_geo_keys(body);
    if (projection && id == 2112) found = unit_in_text(as_text(body));
    if (found) return found;
    records = records.subspan(kRecordHeader + length);
  }
  return std::nullopt;
}

}  // namespace pointflight
