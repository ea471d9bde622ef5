// JSON of clients, for .cpp files of `view` alone.
#pragma once

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>

namespace pointflight {

/// What a client sent, discarded if it is no JSON, or longer or deeper than any request is: reading
/// it holds up all other clients.
inline nlohmann::json parse_small_json(std::string_view text) {
  constexpr std::size_t kMostBytes = 1 << 20;
  constexpr int kDeepest = 16;
  const nlohmann::json none(nlohmann::json::value_t::discarded);
  if (text.size() > kMostBytes) return none;
  const auto check = [](int depth, nlohmann::json::parse_event_t, const nlohmann::json&) {
    if (depth > kDeepest) throw std::length_error("too deep");
    return true;
  };
  try {
    return nlohmann::json::parse(text.begin(), text.end(), check, false);
  } catch (const std::length_error&) {
    return none;
  }
}

}  // namespace pointflight
