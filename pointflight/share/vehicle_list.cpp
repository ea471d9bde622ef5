#include "pointflight/share/vehicle_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <set>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

std::optional<std::size_t> vehicle_from(const std::string& word,
                                        const std::vector<std::string>& names) {
  const auto named = std::find(names.begin(), names.end(), word);
  if (named != names.end()) return static_cast<std::size_t>(named - names.begin());
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  const bool is_number = error == std::errc{} && end == word.data() + word.size();
  return is_number && number < names.size() ? std::optional(number) : std::nullopt;
}

}  // namespace

std::vector<std::size_t> vehicles_from(const std::vector<std::string>& list,
                                       const std::vector<std::string>& names) {
  std::set<std::size_t> vehicles;
  for (const std::string& item : list) {
    std::optional<std::size_t> first = vehicle_from(item, names), last = first;
    for (auto dash = item.find('-'); !last && dash != std::string::npos;
         dash = item.find('-', dash + 1)) {
      first = vehicle_from(item.substr(0, dash), names);
      if (first) last = vehicle_from(item.substr(dash + 1), names);
    }
    if (!last) {
      throw InputError(
          fmt::format("'{}' is no vehicle of the scenario and no range of them; it has 0 to {} ({} "
                      "to {})",
                      item,
                      names.size() - 1,
                      names.front(),
                      names.back()));
    }
    if (*first > *last) throw InputError(fmt::format("{}: from low to high", item));
    for (std::size_t v = *first; v <= *last; ++v) {
      if (!vehicles.insert(v).second)
        throw InputError(fmt::format("{}: {} is named twice", item, names[v]));
    }
  }
  return {vehicles.begin(), vehicles.end()};
}

}  // namespace pointflight
