// What processes that share a run say to each other, in CDR (pointflight/share/messages/*.msg).
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "pointflight/ros/common/codec.hpp"
#include "pointflight/share/message_structs.hpp"

namespace pointflight::share_msg {

/// True for an instant that a run can come to: up to eleven days.
inline bool is_time(std::int64_t ns) {
  constexpr std::int64_t kMost = 1'000'000'000'000'000;
  return ns >= 0 && ns < kMost;
}

/// Why bytes are none of these messages, in words; or nothing, and the head.
struct Opened {
  std::optional<Head> head;  ///< Of a message of this version.
  std::string fault;         ///< Why not.
};
/// The head of a message.
Opened open_message(std::span<const std::byte> bytes);

}  // namespace pointflight::share_msg
