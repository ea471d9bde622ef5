#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "pointflight/ros/common/wire.hpp"

namespace pointflight {

/// A message of a recording; valid during the callback.
struct RecordedMessage {
  const std::string& topic;         ///< "/quad_0/imu"
  const std::string& type;          ///< "sensor_msgs/msg/Imu"
  std::int64_t time = 0;            ///< ns since the Unix epoch.
  std::span<const std::byte> data;  ///< CDR, its header of four bytes included.
};

/// Reads all messages of an MCAP file in the order in which they lie there, from its chunks: of a
/// file that was cut anywhere, all whole chunks. Chunks with a wrong checksum are left out.
/// Throws InputError if it is no MCAP file.
RecordingInfo read_mcap(const std::string& path,
                        const std::function<void(const RecordedMessage&)>& on_message = {});

/// The same from bytes, for tests and fuzzers.
RecordingInfo read_mcap_bytes(std::span<const std::byte> bytes,
                              const std::string& name,
                              const std::function<void(const RecordedMessage&)>& on_message = {});

/// The same messages one after the other, of several files as one: rosbag2 splits what is long.
/// Throws InputError if one is no MCAP file.
std::unique_ptr<MessageReader> open_mcap(const std::vector<std::string>& paths);

/// The data of an attachment of a file. Throws InputError if there is none of this name.
std::string read_mcap_attachment(const std::string& path, const std::string& attachment);

}  // namespace pointflight
