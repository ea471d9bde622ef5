#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "pointflight/ros/common/codec.hpp"
#include "pointflight/ros/common/wire.hpp"

namespace pointflight {

/// Type number of ROS 2's type descriptions (REP 2011; type_description_interfaces/msg/FieldType).
enum class FieldKind : std::uint8_t {
  kNested = 1,
  kInt8 = 2,
  kUint8 = 3,
  kInt16 = 4,
  kUint16 = 5,
  kInt32 = 6,
  kUint32 = 7,
  kInt64 = 8,
  kUint64 = 9,
  kFloat = 10,
  kDouble = 11,
  kBool = 15,
  kByte = 16,
  kString = 17,
};

struct TypeDescription;

/// One row of a message's table.
struct FieldDescription {
  /// What a field holds: one item, as many as `capacity`, or any number.
  enum class Many : std::uint8_t { kOne, kArray, kSequence };
  std::string name;                     ///< On the wire; it may differ between the two ROSes.
  FieldKind kind = FieldKind::kNested;  ///< Of one item.
  Many many = Many::kOne;               ///< How many.
  std::size_t capacity = 0;             ///< Of an array.
  std::shared_ptr<const TypeDescription> nested;  ///< For kNested.
};

/// A message's table of fields as data, for one of the two ROSes.
struct TypeDescription {
  /// The constants are lines "uint8 READY = 1".
  ///@{
  std::string package, name, constants;
  ///@}
  std::vector<FieldDescription> fields;  ///< In the order of the wire.
};

/// The message as .msg text with those of its nested types behind it, as ROS 1 connection headers
/// and MCAP's "ros2msg" schemas have it.
std::string definition_text(const TypeDescription& type, int ros);

/// The md5 sum that ROS 1 compares (genmsg's rules).
std::string md5_of(const TypeDescription& type);

/// The hash that ROS 2 compares from Iron on (REP 2011): "RIHS01_<sha256>".
std::string type_hash_of(const TypeDescription& type);

namespace detail {

template <class T>
constexpr FieldKind kind_of() {
  if constexpr (std::is_same_v<T, bool>) {
    return FieldKind::kBool;
  } else if constexpr (std::is_same_v<T, msg::Octet>) {
    return FieldKind::kByte;
  } else if constexpr (std::is_same_v<T, std::string>) {
    return FieldKind::kString;
  } else if constexpr (std::is_same_v<T, float>) {
    return FieldKind::kFloat;
  } else if constexpr (std::is_same_v<T, double>) {
    return FieldKind::kDouble;
  } else if constexpr (std::is_integral_v<T>) {
    constexpr auto kWide = sizeof(T) == 1 ? 2 : sizeof(T) == 2 ? 4 : sizeof(T) == 4 ? 6 : 8;
    return static_cast<FieldKind>(kWide + (std::is_unsigned_v<T> ? 1 : 0));
  } else {
    return FieldKind::kNested;
  }
}

template <class T>
struct Items {
  using Item = T;
  static constexpr auto kMany = FieldDescription::Many::kOne;
  static constexpr std::size_t kCapacity = 0;
};
template <class T>
struct Items<std::vector<T>> {
  using Item = T;
  static constexpr auto kMany = FieldDescription::Many::kSequence;
  static constexpr std::size_t kCapacity = 0;
};
template <class T, std::size_t N>
struct Items<std::array<T, N>> {
  using Item = T;
  static constexpr auto kMany = FieldDescription::Many::kArray;
  static constexpr std::size_t kCapacity = N;
};

/// Walks over a message's table and notes what it sees.
template <int Ros>
class Describer {
 public:
  static constexpr int kRos = Ros;

  template <class T>
  void operator()(const char* name, const T& /*value*/) {
    using Item = typename Items<T>::Item;
    FieldDescription field;
    field.name = name;
    field.kind = kind_of<Item>();
    field.many = Items<T>::kMany;
    field.capacity = Items<T>::kCapacity;
    if constexpr (Message<Item>) field.nested = std::make_shared<TypeDescription>(of<Item>());
    fields_.push_back(std::move(field));
  }

  template <class M>
  static TypeDescription of() {
    Describer describer;
    const M message;
    M::fields(message, describer);
    const char* package = Ros == 1 ? M::kType.package : M::kType.ros2_package;
    return {package, M::kType.name, M::kType.constants, std::move(describer.fields_)};
  }

 private:
  std::vector<FieldDescription> fields_;
};

}  // namespace detail

/// The table of message M for ROS 1 or 2.
template <class M>
TypeDescription describe_message(int ros) {
  return ros == 1 ? detail::Describer<1>::of<M>() : detail::Describer<2>::of<M>();
}

/// Everything that the two ROSes want to know of a message type.
template <class M>
MessageType message_type() {
  const TypeDescription ros1 = describe_message<M>(1);
  const TypeDescription ros2 = describe_message<M>(2);
  MessageType type;
  type.package = ros1.package;
  type.name = ros1.name;
  type.md5 = md5_of(ros1);
  type.definition = definition_text(ros1, 1);
  if (!M::kType.ros1_only) {
    type.ros2_package = ros2.package;
    type.hash = type_hash_of(ros2);
    type.ros2_definition = definition_text(ros2, 2);
  }
  return type;
}

}  // namespace pointflight
