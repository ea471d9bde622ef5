// A log as it was written, before anybody asks what it means: named tables of numbers, and
// parameters.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pointflight::flight_log {

/// The rows of one message, in the order of the file.
struct LogTable {
  std::vector<std::string> columns;  ///< "gyro_rad[0]"; the first is the time.
  std::vector<double> values;        ///< Row by row.

  [[nodiscard]] std::size_t rows() const {
    return columns.empty() ? 0 : values.size() / columns.size();
  }
  /// Index of a column, or -1.
  [[nodiscard]] int find(std::string_view column) const;
  [[nodiscard]] double at(std::size_t row, int column) const {
    return values[row * columns.size() + static_cast<std::size_t>(column)];
  }
};

/// All that was asked for of a file.
struct LogTables {
  std::map<std::string, LogTable, std::less<>> tables;    ///< By the message's name.
  std::map<std::string, double, std::less<>> parameters;  ///< As they were at last.
  std::uint64_t skipped = 0;  ///< Bytes and messages that made no sense, and gaps.

  /// A table with rows that has all these columns, or null.
  [[nodiscard]] const LogTable* with(std::string_view name,
                                     std::span<const std::string_view> columns) const;
  /// A parameter, or `otherwise`.
  [[nodiscard]] double parameter(std::string_view name, double otherwise) const;
  /// The same of one that counts or chooses, from 0 to 1000; `otherwise` for what is beyond.
  [[nodiscard]] int choice(std::string_view name, int otherwise) const;
};

/// True if a file begins as a log of PX4 (ULog, docs.px4.io/main/en/dev_log/ulog_file_format.html).
bool is_ulog(std::span<const std::byte> bytes);
/// True if it begins as one of ArduPilot (DataFlash: a message FMT that describes itself).
bool is_dataflash(std::span<const std::byte> bytes);

/// Messages whose names are in `wanted`, of the first instance each. A log that ends in the middle
/// of a message, as those of firmwares that lost power do, is read up to there. Throws InputError,
/// with file and byte, for what is no such log.
LogTables read_ulog(std::span<const std::byte> bytes,
                    const std::string& path,
                    const std::set<std::string, std::less<>>& wanted);
/// The same.
LogTables read_dataflash(std::span<const std::byte> bytes,
                         const std::string& path,
                         const std::set<std::string, std::less<>>& wanted);

}  // namespace pointflight::flight_log
