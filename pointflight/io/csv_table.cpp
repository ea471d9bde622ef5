#include "pointflight/io/csv_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {
namespace {

std::string_view unquoted(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\"");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\"") - begin + 1);
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (;;) {
    const std::size_t comma = line.find(',');
    cells.push_back(unquoted(line.substr(0, comma)));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

}  // namespace

CsvTable::CsvTable(const std::string& path) : name_(path) {
  const MappedFile file(path);
  parse(as_text(file.bytes()));
}

CsvTable::CsvTable(std::string_view text, const std::string& name) : name_(name) {
  parse(text);
}

void CsvTable::parse(std::string_view text) {
  LineCursor lines(text);
  std::string_view line;
  while (lines.next(line)) {
    if (unquoted(line).empty() || unquoted(line).front() == '#') continue;
    const auto cells = cells_of(line);
    if (names_.empty()) {
      for (const std::string_view cell : cells) {
        names_.push_back(lower_case(cell));
        if (std::count(names_.begin(), names_.end(), names_.back()) == 1) continue;
        throw InputError(fmt::format(
            "{}:{}: two columns are called '{}'", name_, lines.number(), excerpt(names_.back())));
      }
      continue;
    }
    if (cells.size() != names_.size()) {
      throw InputError(fmt::format("{}:{}: {} columns where the first line names {}",
                                   name_,
                                   lines.number(),
                                   cells.size(),
                                   names_.size()));
    }
    for (const std::string_view cell : cells) {
      double value = std::numeric_limits<double>::quiet_NaN();
      if (!cell.empty() && !parse_number(cell, value)) {
        throw InputError(
            fmt::format("{}:{}: '{}' is no number", name_, lines.number(), excerpt(cell)));
      }
      values_.push_back(value);
    }
    lines_.push_back(lines.number());
    ++rows_;
  }
  if (rows_ == 0) throw InputError(fmt::format("{}: no rows; names, then numbers", name_));
}

std::string CsvTable::location(std::size_t row) const {
  return fmt::format("{}:{}", name_, lines_.at(row));
}

int CsvTable::find(std::string_view prefix) const {
  for (std::size_t i = 0; i < names_.size(); ++i) {
    if (names_[i] == prefix) return static_cast<int>(i);
  }
  for (std::size_t i = 0; i < names_.size(); ++i) {
    if (names_[i].compare(0, prefix.size(), prefix) == 0) return static_cast<int>(i);
  }
  return -1;
}

int CsvTable::require(std::string_view prefix) const {
  const int column = find(prefix);
  if (column < 0) throw InputError(fmt::format("{}: no column named '{}...'", name_, prefix));
  return column;
}

}  // namespace pointflight
