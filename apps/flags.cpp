#include "apps/flags.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight::apps {

CLI::Validator within(double min, double max) {
  const auto check = [min, max](const std::string& text) {
    double value = 0.0;
    // NaN is within nothing
    if (parse_number(text, value) && value >= min && value <= max) return std::string();
    return fmt::format("'{}' is not a number from {} to {}", excerpt(text), min, max);
  };
  return {check, fmt::format("in [{} - {}]", min, max)};
}

void refuse_same_file(const std::string& output, const std::string& input) {
  std::error_code ignored;
  if (output == input || std::filesystem::equivalent(output, input, ignored)) {
    throw InputError(fmt::format(
        "{}: this command reads or writes that file already; give another name", output));
  }
}

}  // namespace pointflight::apps
