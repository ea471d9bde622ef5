#pragma once

#include <limits>
#include <memory>
#include <queue>
#include <set>
#include <vector>

#include "pointflight/core/mapped_file.hpp"
#include "pointflight/recording/internal/mcap_outline.hpp"

namespace pointflight::mcap {

/// An MCAP file in the order of time: chunks are unpacked when they are due and merged where they
/// overlap.
class Timeline : public TimedRecording {
 public:
  /// Of bytes that outlive it. Throws InputError as `Outline`.
  Timeline(std::span<const std::byte> bytes, const std::string& name, const Progress& progress);
  /// Of a file that it keeps.
  Timeline(std::unique_ptr<MappedFile> file, const std::string& name, const Progress& progress);

  [[nodiscard]] const std::vector<RecordedChannel>& channels() const override {
    return outline_.channels();
  }
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> range() const override { return range_; }
  /// No message, or none of a topic that was described: its range means nothing.
  [[nodiscard]] bool is_empty() const { return outline_.pieces().empty() || channels().empty(); }
  void seek(std::int64_t time) override;
  bool next(TimedMessage& message) override;
  void latched_before(std::int64_t time,
                      const std::function<void(const TimedMessage&)>& take) override;

  /// As `Outline::info`, and of the chunks that were unpacked so far how many and how they were
  /// packed; not complete if one of them did not unpack.
  [[nodiscard]] RecordingInfo info() const;

 private:
  using Unpacked = std::shared_ptr<const std::vector<std::byte>>;
  /// A piece whose messages are being given.
  struct Open;
  /// Of equal times the first in the file comes first.
  struct IsLater {
    bool operator()(const std::shared_ptr<Open>& a, const std::shared_ptr<Open>& b) const;
  };

  [[nodiscard]] bool has_one_of(const Piece& piece, const std::set<std::size_t>& wanted) const;
  Unpacked unpack(const Piece& piece);
  void open(std::size_t piece);
  bool advance(Open& open) const;
  [[nodiscard]] bool is_wanted(const Message& message) const {
    return message.time >= from_ && outline_.number_of(message.channel).has_value();
  }

  std::unique_ptr<MappedFile> file_;  ///< None if the bytes are somebody else's.
  Outline outline_;
  std::pair<std::int64_t, std::int64_t> range_{};
  std::int64_t from_ = std::numeric_limits<std::int64_t>::min();
  std::size_t next_piece_ = 0;
  std::size_t unpacked_bytes_ = 0;  ///< Of all chunks that are held; outlives them.
  using Queue =
      std::priority_queue<std::shared_ptr<Open>, std::vector<std::shared_ptr<Open>>, IsLater>;
  Queue open_;     ///< By the message that each gives next.
  Unpacked held_;  ///< Of the message that was given last.
  std::uint64_t chunks_ = 0;
  bool has_broken_chunks_ = false;
  std::set<std::string> compressions_;
};

}  // namespace pointflight::mcap
