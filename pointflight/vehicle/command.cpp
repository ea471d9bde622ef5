#include "pointflight/vehicle/command.hpp"

#include <array>

namespace pointflight {
namespace {

template <class... C>
constexpr std::array<std::string_view, sizeof...(C)> names_of(const std::variant<C...>* /*type*/) {
  return {C::kName...};
}

constexpr auto kSetpointNames = names_of(static_cast<const Setpoint*>(nullptr));

}  // namespace

std::string_view name_of(const Command& command) {
  return std::visit([](const auto& c) { return c.kName; }, command);
}

std::span<const std::string_view> setpoint_names() {
  return kSetpointNames;
}

}  // namespace pointflight
