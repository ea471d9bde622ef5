#include "apps/error_table.hpp"

#include <fmt/format.h>

namespace pointflight::apps {

nlohmann::ordered_json ErrorTable::json(const ErrorStatistics& s) const {
  nlohmann::ordered_json json = {{"rays", s.rays},
                                 {"median_abs_error", s.median_abs_error},
                                 {"p90_abs_error", s.p90_abs_error},
                                 {"p95_abs_error", s.p95_abs_error},
                                 {"bias", s.bias},
                                 {"early_fraction", s.early_fraction},
                                 {"late_fraction", s.late_fraction},
                                 {"missing_fraction", s.missing_fraction},
                                 {"wrong_fraction", s.wrong_fraction},
                                 {"leak_fraction", s.leak_fraction()}};
  if (has_empty_rays) json["false_fraction"] = s.false_fraction;
  return json;
}

void ErrorTable::print_heading() const {
  fmt::print("{:<24} {:>9} {:>8} {:>8} {:>8} {:>8}",
             "",
             "rays",
             "right %",
             "early %",
             "late %",
             "missing%");
  if (has_empty_rays) fmt::print(" {:>8}", "false %");
  fmt::print(" {:>8} {:>8} {:>8} {:>8}\n", "median", "p90", "p95", "bias mm");
}

void ErrorTable::print_row(const std::string& name, const ErrorStatistics& s) const {
  const double right = 1.0 - s.wrong_fraction - s.missing_fraction - s.false_fraction;
  fmt::print("{:<24} {:>9} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.3f}",
             name,
             s.rays,
             100.0 * right,
             100.0 * s.early_fraction,
             100.0 * s.late_fraction,
             100.0 * s.missing_fraction);
  if (has_empty_rays) fmt::print(" {:>8.3f}", 100.0 * s.false_fraction);
  fmt::print(" {:>8.2f} {:>8.2f} {:>8.2f} {:>8.2f}\n",
             1e3 * s.median_abs_error,
             1e3 * s.p90_abs_error,
             1e3 * s.p95_abs_error,
             1e3 * s.bias);
}

}  // namespace pointflight::apps
