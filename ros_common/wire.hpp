// What crosses the border to a ROS transport: names, definitions, bytes, callbacks. C++17, because
// roscpp's headers do not compile as C++20 (tests/ros_common/wire_cpp17.cpp holds it to that).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace pointflight {

/// How both ROSes name and check a message type.
struct MessageType {
  std::string package;          ///< "sensor_msgs"
  std::string name;             ///< "Imu"
  std::string md5;              ///< ROS 1; "*" takes any.
  std::string definition;       ///< ROS 1, with those of nested types.
  std::string ros2_package;     ///< Mostly the same.
  std::string hash;             ///< ROS 2: "RIHS01_" and 64 hexadecimal digits.
  std::string ros2_definition;  ///< "ros2msg" text, with those of nested types.

  /// "sensor_msgs/Imu" and "sensor_msgs/msg/Imu".
  std::string ros1_name() const { return package + "/" + name; }
  std::string ros2_name() const { return ros2_package + "/msg/" + name; }
};

/// A serialised message; shared by all that send or store it.
using Bytes = std::shared_ptr<const std::vector<std::byte>>;

/// How messages become bytes.
enum class Wire { kRos1, kCdr };

/// A topic that goes out or comes in.
struct Topic {
  std::string name;  ///< "/quad_0/imu"
  MessageType type;
  bool latched = false;  ///< Whoever comes late gets the last message.
  std::size_t depth = 10;
  bool large = false;  ///< Clouds and images: paced on ROS 2.
};

/// A message that came in, in the sender's own words.
struct Received {
  const std::byte* data = nullptr;
  std::size_t size = 0;
  std::string md5;         ///< ROS 1: the sender's.
  std::string definition;  ///< ROS 1: the sender's.
};

/// Where serialised messages go: a ROS, or a recording. Called from one thread.
class Outlet {
 public:
  virtual ~Outlet() = default;

  virtual Wire wire() const = 0;

  /// Makes a topic known; returns its number for `send`. All topics come before the first message.
  virtual int advertise(const Topic& topic) = 0;

  /// All topics are known.
  virtual void start() {}

  /// False where nobody would get a message: it need not be made.
  virtual bool has_readers(int topic) const = 0;

  /// `time`: ns since the Unix epoch, when the message leaves; not before the last one's.
  virtual void send(int topic, const Bytes& bytes, std::int64_t time) = 0;

  /// Ends what is open; nothing is sent after.
  virtual void close() {}
};

}  // namespace pointflight
