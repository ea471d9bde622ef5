#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace pointflight {

/// What is in a recording.
struct RecordingInfo {
  struct Topic {
    std::string name, type;
    std::uint64_t messages = 0;
  };
  struct Attachment {
    std::string name, media_type;
    std::uint64_t size = 0;
  };
  std::string format;       ///< "MCAP, profile ros2", "ROS 1 bag 2.0"
  std::string library;      ///< What wrote it, if it says so.
  std::string compression;  ///< "zstd", "lz4", "none"; several with commas.
  std::uint64_t messages = 0, chunks = 0;
  std::int64_t start = 0, end = 0;  ///< ns since the Unix epoch, of the first and last message.
  std::vector<Topic> topics;        ///< By name.
  std::vector<Attachment> attachments;
  bool complete = true;  ///< False: cut short, what is counted is what can be read.
};

/// A message of a recording; valid during the callback.
struct RecordedMessage {
  const std::string& topic;
  const std::string& type;  ///< "sensor_msgs/msg/Imu"
  std::int64_t time = 0;    ///< ns since the Unix epoch.
  std::span<const std::byte> data;
};

/// Reads all messages of an MCAP file in the order in which they lie there, from its chunks: of a
/// file that was cut anywhere, all whole chunks. Chunks with a wrong checksum are left out.
/// Throws InputError where it is no MCAP file.
RecordingInfo read_mcap(const std::string& path,
                        const std::function<void(const RecordedMessage&)>& on_message = {});

/// The same from bytes, for tests and fuzzers.
RecordingInfo read_mcap_bytes(std::span<const std::byte> bytes,
                              const std::string& name,
                              const std::function<void(const RecordedMessage&)>& on_message = {});

/// The data of an attachment of a file. Throws InputError where there is none of this name.
std::string read_mcap_attachment(const std::string& path, const std::string& attachment);

}  // namespace pointflight
