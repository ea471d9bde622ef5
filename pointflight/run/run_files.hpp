// The tables that a run leaves in its folder, read with care: numbers, times, positions, words.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/time.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/csv_table.hpp"
#include "pointflight/map/body.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

/// True for a file with a line beyond that of its columns' names. Throws InputError if something
/// else than a file lies there.
bool has_rows(const std::filesystem::path& path);

/// Times, labels, positions and rotations of a row, from a column on. All throw InputError, with
/// file and line, for what no run writes: what is not finite, or so large that it is not of a run.
///@{
SimTime time_at(const CsvTable& table, std::size_t row, int column);
Label label_at(const CsvTable& table, std::size_t row, int column);
Vector3d position_at(const CsvTable& table, std::size_t row, int column);
/// w, x, y, z.
Quaterniond rotation_at(const CsvTable& table, std::size_t row, int column);
/// px ... wz.
RigidBodyState body_at(const CsvTable& table, std::size_t row, int column);
///@}
/// A velocity, a command, a measurement: NaN where there is none. Throws InputError for infinities.
Vector3d vector_at(const CsvTable& table, std::size_t row, int column);

/// A table that has words in it, row by row. What a column is read as throws InputError, with file
/// and line, if it is not that.
class WordTable {
 public:
  /// Its first line names columns; every other has at least so many. Throws InputError if there is
  /// no such file.
  WordTable(const std::string& path, std::size_t columns);

  /// Goes to the next row, the first at the start. False at the end. Throws InputError if columns
  /// are missing.
  bool next();

  /// File and line of the row, for messages.
  [[nodiscard]] std::string at() const;
  /// As it is written.
  [[nodiscard]] std::string_view word(std::size_t column) const { return words_[column]; }
  /// 0 if it is empty; finite, of a size that runs have.
  [[nodiscard]] double number(std::size_t column) const;
  /// A whole number from 0 on.
  [[nodiscard]] std::uint64_t count(std::size_t column) const { return count_of(word(column)); }
  /// A column, or a part of it, as a whole number below `end`: the scenario has so many of what is
  /// called `what`.
  [[nodiscard]] std::uint32_t index(std::string_view text, std::size_t end, const char* what) const;
  /// As `time_at`.
  [[nodiscard]] SimTime time(std::size_t column) const;
  /// As `label_at`.
  [[nodiscard]] Label label(std::size_t column) const;
  /// As `position_at`.
  [[nodiscard]] Vector3d position(std::size_t column) const;
  /// A position, and as `rotation_at` behind it.
  [[nodiscard]] Pose pose(std::size_t column) const;

 private:
  [[nodiscard]] double number_of(std::string_view text) const;
  [[nodiscard]] std::uint64_t count_of(std::string_view text) const;

  MappedFile file_;
  LineCursor lines_;
  std::size_t columns_;
  std::vector<std::string_view> words_;
};

/// When the run ended, by its summary.json. Throws InputError.
SimTime ended_at(const std::filesystem::path& path);
/// Names of vehicles that other processes flew, by summary.json; none if it does not say.
std::set<std::string> vehicles_of_others(const std::filesystem::path& path);

}  // namespace pointflight
