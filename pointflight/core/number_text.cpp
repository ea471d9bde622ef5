#include "pointflight/core/number_text.hpp"

#include <fmt/format.h>

namespace pointflight {

std::string fixed_text(double value, int decimals) {
  std::string text = fmt::format("{:.{}f}", value, decimals);
  const bool is_zero = text.find_first_of("123456789nif") == std::string::npos;
  if (is_zero && text.front() == '-') text.erase(0, 1);
  return text;
}

std::string plain_text(double value) {
  return fmt::format("{:.9g}", value == 0.0 ? 0.0 : value);
}

std::string point_text(const Eigen::Vector3d& point, int decimals) {
  return fmt::format("({}, {}, {})",
                     fixed_text(point.x(), decimals),
                     fixed_text(point.y(), decimals),
                     fixed_text(point.z(), decimals));
}

}  // namespace pointflight
