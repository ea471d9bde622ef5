// What all messages have.
#pragma once

#include <cstdint>

namespace pointflight::msg {

/// Package and name of a message; the package may differ between ROS 1 and ROS 2.
///
/// Every message is a struct with such a `kType` and a static `fields(message, visitor)`, which
/// calls `visitor(name, field)` for each field in the order of the wire: codecs and definitions
/// walk it. `V::kRos` of the visitor, 1 or 2, tells which ROS is meant. tools/messages.py makes
/// them of `.msg` files.
struct TypeName {
  const char* package = "";            ///< Of ROS 1.
  const char* name = "";               ///< The same in both.
  const char* ros2_package = package;  ///< Of ROS 2: `package` unless it differs.
  const char* constants = "";          ///< Lines "uint8 READY = 1", in the definition's order.
  bool ros1_only = false;              ///< No such type in ROS 2.
};

/// In ROS 2 a message has at least one field.
inline constexpr const char* kNoField = "structure_needs_at_least_one_member";

/// ROS type `byte`: an octet that is no number.
enum class Octet : std::uint8_t {};

}  // namespace pointflight::msg
