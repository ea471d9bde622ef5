// What crosses the border to a ROS transport: names, definitions, bytes, callbacks. C++17, because
// roscpp's headers do not compile as C++20 (tests/ros_common/wire_cpp17.cpp holds it to that).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
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
  /// "sensor_msgs/msg/Imu"
  std::string ros2_name() const { return ros2_package + "/msg/" + name; }
};

/// A serialised message; shared by all that send or store it.
using Bytes = std::shared_ptr<const std::vector<std::byte>>;

/// How messages become bytes.
enum class Wire { kRos1, kCdr };

/// A topic that goes out or comes in.
struct Topic {
  std::string name;        ///< "/quad_0/imu"
  MessageType type;        ///< Checked by both ROSes before they connect.
  bool latched = false;    ///< Whoever comes late gets the last message.
  std::size_t depth = 10;  ///< Messages that a queue holds.
  bool large = false;      ///< Clouds and images: paced on ROS 2.
  bool reliable = false;   ///< Comes in once and counts: read reliably on ROS 2.
  bool answers = false;    ///< Comes in from a planner: what lockstep waits for.
};

/// A service that the node offers.
struct Service {
  std::string kind;     ///< What it is for.
  std::string name;     ///< "/pointflight/reset"
  std::string package;  ///< "std_srvs"
  std::string type;     ///< "Trigger"
  std::string md5;      ///< ROS 1.
  /// ROS 2: of the two halves.
  ///@{
  std::string request_hash, response_hash;
  ///@}
};

/// A received message, with its sender's definition.
struct Received {
  const std::byte* data = nullptr;  ///< Valid during the callback.
  std::size_t size = 0;             ///< Bytes.
  std::string md5;                  ///< ROS 1: the sender's.
  std::string definition;           ///< ROS 1: the sender's.
};

/// Where serialised messages go: a ROS, or a recording. Called from one thread.
class Outlet {
 public:
  virtual ~Outlet() = default;

  /// How this outlet wants its messages.
  virtual Wire wire() const = 0;

  /// Makes a topic known; returns its number for `send`. All topics come before the first message.
  virtual int advertise(const Topic& topic) = 0;

  /// All topics are known.
  virtual void start() {}

  /// False if nobody would get a message: it need not be made.
  virtual bool has_readers(int topic) const = 0;

  /// How many would; at least one if there are readers.
  virtual int reader_count(int topic) const { return has_readers(topic) ? 1 : 0; }

  /// True if somebody reads now; false in a recording.
  virtual bool is_live() const { return false; }

  /// `time`: ns since the Unix epoch, when the message leaves; not before the last one's.
  virtual void send(int topic, const Bytes& bytes, std::int64_t time) = 0;

  /// What was sent may leave now: called after each step.
  virtual void flush() {}

  /// Ends what is open; nothing is sent after.
  virtual void close() {}

  /// Why it had to end, in words for the user; empty if nothing is wrong.
  virtual std::string failure() const { return {}; }
};

/// A ROS: messages go out and come in.
class Transport : public Outlet {
 public:
  bool is_live() const override { return true; }

  /// Calls `on_message` for what is sent on a topic, from a thread of its own; what this transport
  /// sends itself is left out. ROS 1: of whatever definition the sender has (`Received`).
  virtual void subscribe(const Topic& topic, std::function<void(const Received&)> on_message) = 0;

  /// True once it has found the ROS it belongs to (ROS 1: a master).
  virtual bool is_connected() const = 0;

  /// Answers requests of a service by `answer`, which is called from a thread of the transport's.
  using Answer = std::function<std::vector<std::byte>(const Received& request)>;
  /// One answer for each service; what it returns is the response's bytes, in this outlet's wire.
  virtual void serve(const Service& service, Answer answer) = 0;

  /// Ends what is open, both ways: when it returns no message comes in any more.
  void close() override = 0;

  /// True while somebody sends on a topic of a planner's answers.
  virtual bool has_senders() const = 0;

  /// True once somebody outside has ended the node (ROS 1: rosnode kill, another node of its name).
  virtual bool is_over() const { return false; }

  /// False if `close` had to leave threads behind (ROS 1: a master that does not answer): the
  /// process must then end without the destructors of static objects.
  virtual bool has_ended() const { return true; }

  /// Messages that were dropped because somebody was too slow to take them. ROS 2: in the own
  /// queue; what a DDS history lets go it does not tell.
  virtual std::uint64_t dropped() const { return 0; }
};

/// How a transport joins its ROS.
struct TransportOptions {
  std::string node = "pointflight";  ///< Name of the node, without a slash.
  bool localhost_only = false;       ///< ROS 2.
  double large_rate = 0.0;  ///< Bytes per second of clouds and pictures, all read: for ROS 2.
  /// ROS 2: seconds of the run per second at which small messages leave though they come in bursts;
  /// 0: as they come.
  double run_rate = 0.0;
  std::function<void(const std::string&)> log;  ///< Lines for the user, from any thread.
};

/// What is in a recording.
struct RecordingInfo {
  /// One of its topics.
  struct Topic {
    /// "/quad_0/imu" and "sensor_msgs/msg/Imu".
    ///@{
    std::string name, type;
    ///@}
    std::uint64_t messages = 0;  ///< That can be read.
  };
  /// A file inside the recording.
  struct Attachment {
    /// "scenario.yaml" and "text/yaml", say.
    ///@{
    std::string name, media_type;
    ///@}
    std::uint64_t size = 0;  ///< Bytes.
  };
  std::string format;       ///< "MCAP, profile ros2", "ROS 1 bag 2.0"
  std::string library;      ///< What wrote it, if it says so.
  std::string compression;  ///< "zstd", "lz4", "none"; several with commas.
  /// That can be read.
  ///@{
  std::uint64_t messages = 0, chunks = 0;
  ///@}
  /// ns since the Unix epoch, of the first and last message.
  ///@{
  std::int64_t start = 0, end = 0;
  ///@}
  std::vector<Topic> topics;            ///< By name.
  std::vector<Attachment> attachments;  ///< None in bags of ROS 1.
  bool complete = true;                 ///< False: cut short, what is counted is what can be read.
};

/// A message of a recording, as it lies there. Its names and bytes are valid until the next one is
/// read.
struct Recorded {
  /// "/quad_0/imu" and "sensor_msgs/msg/Imu" (ROS 1: "sensor_msgs/Imu").
  ///@{
  std::string_view topic, type;
  ///@}
  std::int64_t time = 0;            ///< ns since the Unix epoch, when it was recorded.
  const std::byte* data = nullptr;  ///< Of the message.
  std::size_t size = 0;             ///< Bytes.
};

/// Reads a recording front to back.
class MessageReader {
 public:
  virtual ~MessageReader() = default;
  /// How its messages became bytes.
  virtual Wire wire() const = 0;
  /// The next message; false if there are none left.
  virtual bool next(Recorded& message) = 0;
  /// Share of the recording that was read, 0 to 1.
  virtual double share_read() const = 0;
};

/// What the ROS 1 module gives; errors are std::runtime_error with words for the user.
struct Ros1Module {
  /// Joins ROS 1; its master may come later.
  std::unique_ptr<Transport> (*transport)(const TransportOptions& options);
  /// A .bag by Debian's rosbag; compression "lz4", "bz2" or "none".
  std::unique_ptr<Outlet> (*bag_writer)(const std::string& path, const std::string& compression);
  /// Errors as above; counts without decoding.
  RecordingInfo (*read_bag)(const std::string& path);
  /// The messages of these topics in the order of their times, of all without any; errors as above.
  std::unique_ptr<MessageReader> (*bag_messages)(const std::string& path,
                                                 const std::vector<std::string>& topics);
};

/// What the ROS 2 module gives.
struct Ros2Module {
  /// Joins ROS 2: the domain of ROS_DOMAIN_ID.
  std::unique_ptr<Transport> (*transport)(const TransportOptions& options);
};

}  // namespace pointflight
