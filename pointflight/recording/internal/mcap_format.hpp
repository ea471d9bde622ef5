// The container format MCAP, version 0 (mcap.dev/spec): opcodes, and records as bytes.
//
//   magic  Header  { Schema, Channel, Chunk, MessageIndex ..., Attachment, Metadata }  DataEnd
//   summary: { Schema, Channel, ChunkIndex, AttachmentIndex, MetadataIndex, Statistics }
//   SummaryOffset ...  Footer  magic
//
// A record is an opcode (1 byte), the length of its content (8 bytes) and the content. Numbers are
// little-endian; strings and maps have a length of 4 bytes in front.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pointflight::mcap {

inline constexpr std::array<std::uint8_t, 8> kMagic = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

inline constexpr std::size_t kRecordHead = 9;  // opcode and length

using StringMap = std::map<std::string, std::string>;

/// One record's content, or records one after another.
class RecordWriter {
 public:
  /// What a record begins with; `length` bytes of content follow.
  RecordWriter& head(Opcode opcode, std::uint64_t length) {
    return number(static_cast<std::uint8_t>(opcode)).number(length);
  }
  /// A whole record.
  RecordWriter& record(Opcode opcode, std::span<const std::byte> content) {
    return head(opcode, content.size()).raw(content);
  }
  template <class T>
  RecordWriter& number(T value) {
    const auto* first = reinterpret_cast<const std::byte*>(&value);
    bytes_.insert(bytes_.end(), first, first + sizeof(T));
    return *this;
  }
  RecordWriter& raw(std::span<const std::byte> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  RecordWriter& text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    return raw(std::as_bytes(std::span(value.data(), value.size())));
  }
  RecordWriter& map(const StringMap& values) {
    RecordWriter inner;
    for (const auto& [key, value] : values) inner.text(key).text(value);
    number(static_cast<std::uint32_t>(inner.bytes_.size()));
    return raw(inner.bytes_);
  }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }
  /// Empty again; the memory is kept.
  void clear() { bytes_.clear(); }

 private:
  std::vector<std::byte> bytes_;
};

/// Reads a record's content; after something that does not fit `ok` stays false and all is zero.
class RecordReader {
 public:
  explicit RecordReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }

  template <class T>
  T number() {
    T value{};
    const auto from = take(sizeof(T));
    if (!from.empty()) std::memcpy(&value, from.data(), sizeof(T));
    return value;
  }
  std::string text() {
    const auto from = take(number<std::uint32_t>());
    return {reinterpret_cast<const char*>(from.data()), from.size()};
  }
  std::span<const std::byte> take(std::uint64_t size) {
    if (!ok_ || size > left()) {
      ok_ = false;
      return {};
    }
    const auto from = bytes_.subspan(at_, size);
    at_ += size;
    return from;
  }
  StringMap map() {
    StringMap values;
    RecordReader inner(take(number<std::uint32_t>()));
    while (inner.ok() && inner.left() > 0) {
      std::string key = inner.text();
      values[std::move(key)] = inner.text();
    }
    ok_ = ok_ && inner.ok();
    return values;
  }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace pointflight::mcap
