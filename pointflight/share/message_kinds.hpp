#pragma once

#include <cstdint>

namespace pointflight::share_msg {

/// Which message it is.
enum class Kind : std::uint16_t { kIntroduction = 1, kStates, kClock, kPast, kBeat };

/// How far a process has come.
enum class Phase : std::uint8_t { kJoining, kFlying, kLeft };

}  // namespace pointflight::share_msg
