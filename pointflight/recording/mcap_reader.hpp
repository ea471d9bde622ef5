// MCAP files, read: a file that was cut anywhere as far as its last whole chunk. Chunks that do not
// unpack to their checksum are left out.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "pointflight/core/progress.hpp"
#include "pointflight/ros/common/timed_recording.hpp"
#include "pointflight/ros/common/wire.hpp"

namespace pointflight {

/// An MCAP file as a `TimedRecording`. What it says of itself at its end is taken if it is
/// there; of a file that was cut, all whole chunks are looked through once. Chunks that overlap in
/// time are merged, as far as half a GiB of them does.
/// Throws InputError if it is no MCAP file or holds no message.
std::unique_ptr<TimedRecording> open_timed_mcap(const std::string& path,
                                                const Progress& progress = {});

/// The same of bytes, which must outlive it: for tests and fuzzers.
std::unique_ptr<TimedRecording> timed_mcap(std::span<const std::byte> bytes,
                                           const std::string& name,
                                           const Progress& progress = {});

/// The messages of several files as one, file after file, each in the order of time: rosbag2 splits
/// what is long. Throws InputError if one is no MCAP file.
std::unique_ptr<MessageReader> open_mcap(const std::vector<std::string>& paths,
                                         const Progress& progress = {});

/// What is in a file, counted by reading all of it. Throws InputError if it is no MCAP file.
RecordingInfo read_mcap(const std::string& path, const Progress& progress = {});

/// The same of bytes, for tests and fuzzers.
RecordingInfo read_mcap_bytes(std::span<const std::byte> bytes, const std::string& name);

}  // namespace pointflight
