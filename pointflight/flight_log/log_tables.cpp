#include "pointflight/flight_log/internal/log_tables.hpp"

#include <algorithm>

namespace pointflight::flight_log {

int LogTable::find(std::string_view column) const {
  const auto found = std::find(columns.begin(), columns.end(), column);
  return found == columns.end() ? -1 : static_cast<int>(found - columns.begin());
}

const LogTable* LogTables::with(std::string_view name,
                                std::span<const std::string_view> columns) const {
  const auto found = tables.find(name);
  if (found == tables.end() || found->second.rows() == 0) return nullptr;
  const LogTable& table = found->second;
  const bool has_all = std::all_of(columns.begin(), columns.end(), [&](std::string_view column) {
    return table.find(column) >= 0;
  });
  return has_all ? &table : nullptr;
}

double LogTables::parameter(std::string_view name, double otherwise) const {
  const auto found = parameters.find(name);
  return found == parameters.end() ? otherwise : found->second;
}

int LogTables::choice(std::string_view name, int otherwise) const {
  const double value = parameter(name, otherwise);
  return value >= 0.0 && value <= 1000.0 ? static_cast<int>(value) : otherwise;
}

}  // namespace pointflight::flight_log
