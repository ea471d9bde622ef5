// Serialised messages as roscpp and rosbag take them: with the type that they have at run time.
#pragma once

#include <ros/message_event.h>
#include <ros/message_traits.h>
#include <ros/serialization.h>

#include "ros_common/wire.hpp"

namespace pointflight {

/// On its way out.
struct RawMessage {
  const Topic* topic = nullptr;
  Bytes bytes;
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

}  // namespace serialization
}  // namespace ros
