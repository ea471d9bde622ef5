#include "pointflight/core/registry.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pointflight/core/input_error.hpp"

namespace pointflight {

void throw_unknown(std::string_view what,
                   std::string_view name,
                   const std::vector<std::string_view>& names) {
  throw InputError(
      fmt::format("{} '{}' is unknown; one of: {}", what, name, fmt::join(names, ", ")));
}

}  // namespace pointflight
