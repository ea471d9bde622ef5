#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "pointflight/fidelity/error_statistics.hpp"

namespace pointflight::apps {

/// How `fidelity` and `compare` show error statistics.
struct ErrorTable {
  /// Whether some rays hit nothing in truth: real scans have none of those.
  bool has_empty_rays = false;

  /// As in the struct: shares 0 to 1, lengths in m.
  [[nodiscard]] nlohmann::ordered_json json(const ErrorStatistics& statistics) const;
  /// On stdout: shares in %, lengths in mm.
  void print_heading() const;
  void print_row(const std::string& name, const ErrorStatistics& statistics) const;
};

}  // namespace pointflight::apps
