#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pointflight/core/progress.hpp"
#include "pointflight/recording/internal/mcap_chunk.hpp"
#include "pointflight/ros/common/timed_recording.hpp"
#include "pointflight/ros/common/wire.hpp"

namespace pointflight::mcap {

using ChannelId = std::uint16_t;

struct Record {
  Opcode opcode{};
  std::span<const std::byte> content;
};

/// The record at an offset, which goes to the next one. Nothing if none is whole there.
inline std::optional<Record> record_at(std::span<const std::byte> bytes, std::size_t& at) {
  if (bytes.size() - at < mcap::kRecordHead) return std::nullopt;
  std::uint64_t length = 0;
  std::memcpy(&length, bytes.data() + at + 1, sizeof(length));
  if (length > bytes.size() - at - mcap::kRecordHead) return std::nullopt;
  const Record record{static_cast<Opcode>(bytes[at]),
                      bytes.subspan(at + mcap::kRecordHead, length)};
  at += mcap::kRecordHead + length;
  return record;
}

/// Calls `take(opcode, content)` for each whole record, until it returns false.
template <class Take>
void each_record(std::span<const std::byte> bytes, const Take& take) {
  std::size_t at = 0;
  while (const auto record = record_at(bytes, at)) {
    if (!take(record->opcode, record->content)) return;
  }
}

/// A message of a channel by its number in the file.
struct Message {
  ChannelId channel = 0;
  std::int64_t time = 0;
  std::span<const std::byte> data;
};

/// Nothing if the record is cut, or says a time that no clock shows.
std::optional<Message> message_of(std::span<const std::byte> content);

/// Where messages lie: a chunk, or records of the file between two of them.
struct Piece {
  std::int64_t start = 0, end = 0;     ///< ns
  std::optional<PackedChunk> chunk;    ///< Nothing: messages of the file itself.
  std::span<const std::byte> records;  ///< These, then.
  std::vector<ChannelId> channels;     ///< That it has; none: there is no index.
};

/// What is known of a file without its messages, by one walk over the heads of its records.
class Outline {
 public:
  /// Of a whole file. Throws InputError if it does not begin with the magic, or its types are too
  /// long to be true.
  Outline(std::span<const std::byte> bytes, const std::string& name, const Progress& progress);

  /// By the times of their first messages.
  [[nodiscard]] const std::vector<Piece>& pieces() const { return pieces_; }
  [[nodiscard]] const std::vector<RecordedChannel>& channels() const { return channels_; }
  /// Its index in `channels`; nothing for one that was never described.
  [[nodiscard]] std::optional<std::size_t> number_of(ChannelId id) const {
    const auto found = numbers_.find(id);
    return found == numbers_.end() ? std::nullopt : std::optional(found->second);
  }
  /// Format, library and attachments; complete if the file has its end and all chunks make sense.
  [[nodiscard]] const RecordingInfo& info() const { return info_; }

 private:
  struct Schema {
    std::string name, encoding, text;
  };

  void note(Opcode opcode, std::span<const std::byte> content);
  void describe(Opcode opcode, RecordReader& reader);
  void count_schema(std::size_t bytes);
  void note_loose(std::span<const std::byte> content);
  void end_loose();
  void look_into_chunks(const Progress& progress);

  std::string name_;
  RecordingInfo info_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<ChannelId, std::size_t> numbers_;
  std::vector<RecordedChannel> channels_;
  std::vector<Piece> pieces_;
  std::size_t schema_bytes_ = 0;
  Piece loose_;
  bool data_ended_ = false;
  bool has_summary_ = false;
  bool lacks_chunks_ = false;  ///< One was left out: too large, or with times that are none.
};

}  // namespace pointflight::mcap
