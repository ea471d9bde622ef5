// A recording whose messages can be had from any time on, whatever they are: for showing it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace pointflight {

/// A topic as its recording describes it, with all that a stranger needs to read its messages.
struct RecordedChannel {
  std::string topic;            ///< "/quad_0/odom"
  std::string encoding;         ///< Of its messages: "cdr", "ros1", "json".
  std::string schema_name;      ///< "nav_msgs/msg/Odometry"
  std::string schema_encoding;  ///< "ros2msg", "ros1msg"
  std::string schema;           ///< Its text.
  bool latched = false;         ///< Its last message holds until there is another.
};

/// A message; its bytes are valid until the recording is asked for another.
struct TimedMessage {
  std::size_t channel = 0;          ///< In `channels`.
  std::int64_t time = 0;            ///< ns since the Unix epoch, when it was recorded.
  std::span<const std::byte> data;  ///< In its channel's encoding.
};

/// Read in the order of time, from any time on. For one thread.
class TimedRecording {
 public:
  virtual ~TimedRecording() = default;

  /// All of them, those without messages too.
  [[nodiscard]] virtual const std::vector<RecordedChannel>& channels() const = 0;
  /// Times of the first and last message, ns since the Unix epoch.
  [[nodiscard]] virtual std::pair<std::int64_t, std::int64_t> range() const = 0;
  /// The next message is the first one at `time` or after it.
  virtual void seek(std::int64_t time) = 0;
  /// False if there are none left.
  virtual bool next(TimedMessage& message) = 0;
  /// Of each latched channel the last message before `time`, to `take`; the next message stays.
  virtual void latched_before(std::int64_t time,
                              const std::function<void(const TimedMessage&)>& take) = 0;
};

}  // namespace pointflight
