#pragma once

#include <functional>

#include "pointflight/ros/common/timed_recording.hpp"
#include "pointflight/view/live_server.hpp"

namespace pointflight {

/// Plays a recording to a server's clients as it lies there: its channels with their schemas, its
/// messages at their times. Clients pause, step (to the next large message: a scan, a picture), set
/// the pace and jump; after a jump they get what latched topics held then. It starts when somebody
/// looks, at its end it stands still; it ends, and closes the server, once `interrupted` says so.
/// The server's `range` is to be the recording's.
void play(TimedRecording& recording, LiveServer& server, const std::function<bool()>& interrupted);

}  // namespace pointflight
