// Messages to bytes and back, for both wires: ROS 1's own serialisation and CDR (XCDR1, plain, as
// DDS and MCAP carry it, with its header of four bytes). Little-endian out; CDR of both orders in.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstring>
#include <optional>
#include <span>
#include <type_traits>

#include "pointflight/ros/common/messages.hpp"
#include "pointflight/ros/common/wire.hpp"

namespace pointflight {

static_assert(std::endian::native == std::endian::little, "written for little-endian machines");

namespace detail {

template <class T>
concept Number = std::is_arithmetic_v<T> || std::is_enum_v<T>;
template <class T>
concept Message = requires {
  T::kType;
};

template <class T>
T swapped(T value) {
  std::array<std::byte, sizeof(T)> bytes;  // NOLINT(cppcoreguidelines-pro-type-member-init)
  std::memcpy(bytes.data(), &value, sizeof(T));
  for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(bytes[i], bytes[sizeof(T) - 1 - i]);
  std::memcpy(&value, bytes.data(), sizeof(T));
  return value;
}

}  // namespace detail

/// Appends a message's fields to bytes.
template <Wire W>
class WireWriter {
 public:
  /// Which table of fields messages show it.
  static constexpr int kRos = W == Wire::kRos1 ? 1 : 2;

  /// Appends to `bytes`, which must outlive the writer; CDR aligns from their present end on.
  explicit WireWriter(std::vector<std::byte>& bytes) : bytes_(bytes), start_(bytes.size()) {}

  /// Called by a message's `fields`.
  template <class T>
  void operator()(const char* /*name*/, const T& value) {
    write(value);
  }

  /// Numbers little-endian; texts and lists behind their lengths, arrays without; messages field by
  /// field.
  ///@{
  template <detail::Number T>
  void write(T value) {
    align(sizeof(T));
    append(&value, sizeof(T));
  }
  void write(const std::string& text) {
    const std::size_t zero = W == Wire::kCdr ? 1 : 0;
    write(static_cast<std::uint32_t>(text.size() + zero));
    append(text.c_str(), text.size() + zero);
  }
  template <class T>
  void write(const std::vector<T>& items) {
    write(static_cast<std::uint32_t>(items.size()));
    write_items(items.data(), items.size());
  }
  template <class T, std::size_t N>
  void write(const std::array<T, N>& items) {
    write_items(items.data(), N);
  }
  template <detail::Message M>
  void write(const M& message) {
    M::fields(message, *this);
  }
  ///@}

 private:
  template <class T>
  void write_items(const T* items, std::size_t count) {
    if constexpr (detail::Number<T>) {
      if (count == 0) return;
      align(sizeof(T));
      append(items, count * sizeof(T));
    } else {
      for (std::size_t i = 0; i < count; ++i) write(items[i]);
    }
  }
  void align(std::size_t size) {
    if constexpr (W == Wire::kCdr) {
      const std::size_t over = (bytes_.size() - start_) % size;
      if (over != 0) bytes_.resize(bytes_.size() + size - over);
    }
  }
  void append(const void* from, std::size_t size) {
    const auto* first = static_cast<const std::byte*>(from);
    bytes_.insert(bytes_.end(), first, first + size);
  }

  std::vector<std::byte>& bytes_;
  std::size_t start_;  ///< Alignment counts from here.
};

/// Reads a message's fields; whatever the bytes are, it reads nothing outside of them and takes no
/// more memory than a small multiple of their number.
template <Wire W>
class WireReader {
 public:
  /// Which table of fields messages show it.
  static constexpr int kRos = W == Wire::kRos1 ? 1 : 2;

  /// CDR aligns from the start of `bytes`, which must outlive the reader.
  WireReader(std::span<const std::byte> bytes, bool big_endian)
      : bytes_(bytes), big_endian_(big_endian) {}

  /// False from the first value on that the bytes do not hold; the message must not be used then.
  [[nodiscard]] bool ok() const { return ok_; }
  /// Bytes that were not read yet.
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }

  /// Called by a message's `fields`.
  template <class T>
  void operator()(const char* /*name*/, T& value) {
    read(value);
  }

  /// What the writer wrote; a value that is not there is left as it was.
  ///@{
  template <detail::Number T>
  void read(T& value) {
    align(sizeof(T));
    const std::byte* from = take(sizeof(T));
    if (from == nullptr) return;
    if constexpr (std::is_same_v<T, bool>) {
      value = *from != std::byte{0};
    } else {
      std::memcpy(&value, from, sizeof(T));
      if (big_endian_) value = detail::swapped(value);
    }
  }
  void read(std::string& text) {
    std::uint32_t size = 0;
    read(size);
    const std::byte* from = take(size);
    if (from == nullptr) return;
    // CDR counts the closing zero
    if (W == Wire::kCdr && size > 0) {
      if (from[size - 1] != std::byte{0}) {
        ok_ = false;
        return;
      }
      --size;
    }
    text.assign(reinterpret_cast<const char*>(from), size);
  }
  template <class T>
  void read(std::vector<T>& items) {
    std::uint32_t count = 0;
    read(count);
    items.clear();
    if (!ok_ || count == 0) return;
    if constexpr (detail::Number<T>) {
      align(sizeof(T));
      if (count > left() / sizeof(T)) {
        ok_ = false;
        return;
      }
      items.resize(count);
      read_items(items.data(), count);
    } else {
      // one by one: a length alone must not take memory
      for (std::uint32_t i = 0; i < count && ok_; ++i) read(items.emplace_back());
    }
  }
  template <class T, std::size_t N>
  void read(std::array<T, N>& items) {
    read_items(items.data(), N);
  }
  template <detail::Message M>
  void read(M& message) {
    M::fields(message, *this);
  }
  ///@}

 private:
  template <class T>
  void read_items(T* items, std::size_t count) {
    if constexpr (detail::Number<T> && !std::is_same_v<T, bool>) {
      align(sizeof(T));
      const std::byte* from = take(count * sizeof(T));
      if (from == nullptr) return;
      std::memcpy(items, from, count * sizeof(T));
      for (std::size_t i = 0; i < count && big_endian_; ++i) items[i] = detail::swapped(items[i]);
    } else {
      for (std::size_t i = 0; i < count && ok_; ++i) read(items[i]);
    }
  }
  void align(std::size_t size) {
    if constexpr (W == Wire::kCdr) {
      const std::size_t over = at_ % size;
      if (over != 0) take(size - over);
    }
  }
  const std::byte* take(std::size_t size) {
    if (!ok_ || size > left()) {
      ok_ = false;
      return nullptr;
    }
    const std::byte* from = bytes_.data() + at_;
    at_ += size;
    return from;
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool big_endian_;
  bool ok_ = true;
};

/// Bytes of a message.
template <Wire W, class M>
std::vector<std::byte> encode(const M& message) {
  std::vector<std::byte> bytes;
  bytes.reserve(128);  // most fit; and gcc 12 warns of bounds that it guesses wrong without
  if constexpr (W == Wire::kCdr) {
    bytes.resize(4);
    bytes[1] = std::byte{1};  // little-endian
  }
  WireWriter<W> writer(bytes);
  writer.write(message);
  return bytes;
}

/// The message that the bytes stand for; nothing if they are malformed or left over (CDR allows
/// three of padding). `is_head`: any number may follow, for a message's header by itself.
template <Wire W, class M>
std::optional<M> decode(std::span<const std::byte> bytes, bool is_head = false) {
  bool big_endian = false;
  std::size_t spare = 0;
  if constexpr (W == Wire::kCdr) {
    if (bytes.size() < 4 || bytes[0] != std::byte{0} || bytes[1] > std::byte{1}) {
      return std::nullopt;
    }
    big_endian = bytes[1] == std::byte{0};
    bytes = bytes.subspan(4);
    spare = 3;
  }
  M message;
  WireReader<W> reader(bytes, big_endian);
  reader.read(message);
  if (!reader.ok() || (!is_head && reader.left() > spare)) return std::nullopt;
  return message;
}

}  // namespace pointflight
