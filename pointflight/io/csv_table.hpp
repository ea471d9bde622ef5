#pragma once

#include <cassert>
#include <string>
#include <string_view>
#include <vector>

namespace pointflight {

/// A small table of numbers with named columns; empty cells are NaN. Lines that start with # are
/// comments.
class CsvTable {
 public:
  /// Throws InputError with file and line.
  explicit CsvTable(const std::string& path);
  /// From text; `name` stands for the path in messages.
  CsvTable(std::string_view text, const std::string& name);

  /// Without the line of names and comments.
  [[nodiscard]] std::size_t rows() const { return rows_; }

  /// Of each row.
  [[nodiscard]] std::size_t columns() const { return names_.size(); }

  /// Index of the column of that name, else of the first whose name starts with it (lower case), or
  /// -1.
  [[nodiscard]] int find(std::string_view prefix) const;

  /// As `find`, but throws InputError if there is no such column.
  [[nodiscard]] int require(std::string_view prefix) const;

  /// "file:line" of a row, for messages. Throws std::out_of_range if there is no such row.
  [[nodiscard]] std::string location(std::size_t row) const;

  /// NaN for an empty cell. `row` below rows(), `column` as `find` or `require` gave it and not -1:
  /// debug builds assert it.
  [[nodiscard]] double at(std::size_t row, int column) const {
    assert(row < rows_ && column >= 0 && static_cast<std::size_t>(column) < names_.size());
    return values_[row * names_.size() + static_cast<std::size_t>(column)];
  }

 private:
  void parse(std::string_view text);

  std::string name_;
  std::vector<std::string> names_;
  std::vector<double> values_;
  std::vector<std::size_t> lines_;
  std::size_t rows_ = 0;
};

}  // namespace pointflight
