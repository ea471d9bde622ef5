#pragma once

#include <memory>
#include <string>

#include "pointflight/core/progress.hpp"
#include "pointflight/ros/common/timed_recording.hpp"

namespace pointflight {

/// An MCAP file as a `TimedRecording`. What it says of itself at its end is taken if it is
/// there; of a file that was cut, all whole chunks are looked through once. Chunks that do not
/// unpack are left out; those that overlap in time are merged, as far as half a GiB of them does.
/// Throws InputError if it is no MCAP file or holds no message.
std::unique_ptr<TimedRecording> open_timed_mcap(const std::string& path,
                                                const Progress& progress = {});

/// The same of bytes, which must outlive it: for tests and fuzzers.
std::unique_ptr<TimedRecording> timed_mcap(std::span<const std::byte> bytes,
                                           const std::string& name,
                                           const Progress& progress = {});

}  // namespace pointflight
