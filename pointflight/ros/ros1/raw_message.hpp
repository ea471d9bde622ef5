// Serialised messages as roscpp and rosbag take them: with the type that they have at run time.
#pragma once

#include <ros/message_event.h>
#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <atomic>
#include <chrono>
#include <cstring>

#include "pointflight/ros/common/wire.hpp"

namespace pointflight {

/// What became of a topic's messages. roscpp tells nobody when it throws the oldest one away
/// because a subscriber's queue is full; but its buffer then ends with a queue of newer ones behind
/// it.
struct SentCount {
  std::size_t depth = 0;  ///< Of the queues.
  std::atomic<std::uint64_t> published{0};
  std::atomic<std::uint64_t> dropped{0};
};

/// On its way out.
struct RawMessage {
  const Topic* topic = nullptr;
  Bytes bytes;
  std::shared_ptr<SentCount> count;  ///< None in a recording.
};

/// As it came in.
struct RawReceived {
  std::vector<std::byte> bytes;
};

}  // namespace pointflight

namespace ros {
namespace message_traits {

template <>
struct IsMessage<pointflight::RawMessage> : TrueType {};
template <>
struct MD5Sum<pointflight::RawMessage> {
  static const char* value() { return "*"; }
  static const char* value(const pointflight::RawMessage& m) { return m.topic->type.md5.c_str(); }
};
template <>
struct DataType<pointflight::RawMessage> {
  static const char* value() { return "*"; }
  static const char* value(const pointflight::RawMessage& m) {
    static thread_local std::string name;
    name = m.topic->type.ros1_name();
    return name.c_str();
  }
};
template <>
struct Definition<pointflight::RawMessage> {
  static const char* value() { return ""; }
  static const char* value(const pointflight::RawMessage& m) {
    return m.topic->type.definition.c_str();
  }
};

template <>
struct IsMessage<pointflight::RawReceived> : TrueType {};
template <>
struct MD5Sum<pointflight::RawReceived> {
  static const char* value() { return "*"; }
  static const char* value(const pointflight::RawReceived& /*m*/) { return "*"; }
};
template <>
struct DataType<pointflight::RawReceived> {
  static const char* value() { return "*"; }
  static const char* value(const pointflight::RawReceived& /*m*/) { return "*"; }
};
template <>
struct Definition<pointflight::RawReceived> {
  static const char* value() { return ""; }
  static const char* value(const pointflight::RawReceived& /*m*/) { return ""; }
};

}  // namespace message_traits

namespace serialization {

template <>
struct Serializer<pointflight::RawMessage> {
  template <class Stream>
  static void write(Stream& stream, const pointflight::RawMessage& m) {
    std::memcpy(
        stream.advance(static_cast<uint32_t>(m.bytes->size())), m.bytes->data(), m.bytes->size());
  }
  static uint32_t serializedLength(const pointflight::RawMessage& m) {
    return static_cast<uint32_t>(m.bytes->size());
  }
};

template <>
struct Serializer<pointflight::RawReceived> {
  template <class Stream>
  static void read(Stream& stream, pointflight::RawReceived& m) {
    const auto size = stream.getLength();
    const auto* first = reinterpret_cast<const std::byte*>(stream.advance(size));
    m.bytes.assign(first, first + size);
  }
};

/// As roscpp's own, with a buffer that notices how it ends.
template <>
inline SerializedMessage serializeMessage(const pointflight::RawMessage& message) {
  using Clock = std::chrono::steady_clock;
  // a burst that waits for roscpp's thread is no slow subscriber
  static constexpr std::chrono::milliseconds kStall(40);
  const auto size = static_cast<uint32_t>(message.bytes->size());
  SerializedMessage m;
  m.num_bytes = size + sizeof(size);
  m.buf.reset(new uint8_t[m.num_bytes],
              [count = message.count, number = ++message.count->published, since = Clock::now()](
                  const uint8_t* buffer) {
                const bool full = count->depth > 1 && count->published - number >= count->depth;
                if (full && Clock::now() - since > kStall) ++count->dropped;
                delete[] buffer;
              });
  std::memcpy(m.buf.get(), &size, sizeof(size));  // of this machine: little-endian, as the wire
  m.message_start = m.buf.get() + sizeof(size);
  std::memcpy(m.message_start, message.bytes->data(), size);
  return m;
}

}  // namespace serialization
}  // namespace ros
