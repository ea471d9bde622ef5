#include "pointflight/recording/mcap_timeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <queue>
#include <set>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/recording/internal/mcap_chunk.hpp"
#include "pointflight/recording/internal/mcap_format.hpp"

namespace pointflight {
namespace {

using mcap::Opcode;
using mcap::RecordReader;
using ChannelId = std::uint16_t;

/// Of unpacked chunks that are merged by time; a recorder's overlap by one or two.
constexpr std::size_t kMostUnpacked = std::size_t{512} << 20;

/// Messages of a file without chunks are loaded so many bytes at a time.
constexpr std::size_t kLoosePiece = std::size_t{4} << 20;

/// Texts of types, each channel's counted: a few KiB in truth.
constexpr std::size_t kMostSchemas = std::size_t{64} << 20;

/// Times count from here on as ns of an int64 that differences fit into.
constexpr std::uint64_t kLatestTime = std::uint64_t{1} << 62;

/// The channel's QoS, as rosbag2 and our writer put it into the metadata: a list in YAML, with
/// durability by its number in rmw (1: transient local) or, since Jazzy, by its name.
bool is_latched(const mcap::StringMap& metadata) {
  const auto qos = metadata.find("offered_qos_profiles");
  if (qos == metadata.end()) return false;
  const std::string& text = qos->second;
  return text.find("durability: 1") != std::string::npos ||
         text.find("durability: transient_local") != std::string::npos;
}

/// Calls `take(opcode, content)` for each whole record, until it returns false.
template <class Take>
void each_record(std::span<const std::byte> bytes, const Take& take) {
  std::size_t at = 0;
  while (bytes.size() - at >= mcap::kRecordHead) {
    const auto opcode = static_cast<Opcode>(bytes[at]);
    std::uint64_t length = 0;
    std::memcpy(&length, bytes.data() + at + 1, sizeof(length));
    if (length > bytes.size() - at - mcap::kRecordHead) return;
    if (!take(opcode, bytes.subspan(at + mcap::kRecordHead, length))) return;
    at += mcap::kRecordHead + length;
  }
}

struct Message {
  ChannelId channel = 0;
  std::int64_t time = 0;
  std::span<const std::byte> data;
};

std::optional<Message> message_of(std::span<const std::byte> content) {
  RecordReader reader(content);
  Message message;
  message.channel = reader.number<std::uint16_t>();
  static_cast<void>(reader.take(4));  // sequence
  const auto time = reader.number<std::uint64_t>();
  static_cast<void>(reader.take(8));  // when it was published
  if (!reader.ok() || time > kLatestTime) return std::nullopt;
  message.time = static_cast<std::int64_t>(time);
  message.data = reader.take(reader.left());
  return message;
}

/// Where messages lie: a chunk, or records of the file between two of them.
struct Piece {
  std::int64_t start = 0, end = 0;         ///< ns
  std::optional<mcap::PackedChunk> chunk;  ///< Nothing: messages of the file itself.
  std::span<const std::byte> records;      ///< These, then.
  std::vector<ChannelId> channels;         ///< That it has; none: there is no index.
};

/// What is known of a file without its messages.
class Outline {
 public:
  /// Throws InputError if its types are too long to be true.
  Outline(std::span<const std::byte> bytes, const std::string& name, const Progress& progress)
      : name_(name) {
    each_record(bytes, [&](Opcode opcode, std::span<const std::byte> content) {
      note(opcode, content);
      return opcode != Opcode::kFooter;
    });
    end_loose();
    // a summary repeats all channels; without one they are said where they are first used
    if (!has_summary_) look_into_chunks(progress);
    std::erase_if(pieces_, [](const Piece& piece) {  // so says a chunk without messages
      return piece.start == 0 && piece.end == 0 && piece.channels.empty();
    });
    std::stable_sort(pieces_.begin(), pieces_.end(), [](const Piece& a, const Piece& b) {
      return a.start < b.start;
    });
  }

  [[nodiscard]] std::vector<Piece>& pieces() { return pieces_; }
  [[nodiscard]] const std::vector<RecordedChannel>& channels() const { return channels_; }
  /// Its place in `channels`; nothing for one that was never described.
  [[nodiscard]] std::optional<std::size_t> number_of(ChannelId id) const {
    const auto found = numbers_.find(id);
    return found == numbers_.end() ? std::nullopt : std::optional(found->second);
  }

 private:
  struct Schema {
    std::string name, encoding, text;
  };

  void note(Opcode opcode, std::span<const std::byte> content) {
    if (opcode == Opcode::kMessage && !data_ended_) return note_loose(content);
    if (opcode != Opcode::kMessageIndex) end_loose();
    RecordReader reader(content);
    if (opcode == Opcode::kChunk && !data_ended_) {
      const auto chunk = mcap::chunk_of(reader);
      if (!chunk || chunk->start > chunk->end || chunk->end > kLatestTime) return;
      Piece& piece = pieces_.emplace_back();
      piece.start = static_cast<std::int64_t>(chunk->start);
      piece.end = static_cast<std::int64_t>(chunk->end);
      piece.chunk = *chunk;
    } else if (opcode == Opcode::kMessageIndex && !pieces_.empty()) {
      pieces_.back().channels.push_back(reader.number<std::uint16_t>());
    } else if (opcode == Opcode::kDataEnd) {
      data_ended_ = true;
    } else {
      describe(opcode, reader);
    }
  }

  void describe(Opcode opcode, RecordReader& reader) {
    if (opcode == Opcode::kSchema) {
      const auto id = reader.number<std::uint16_t>();
      Schema schema;
      schema.name = reader.text();
      schema.encoding = reader.text();
      schema.text = reader.text();
      if (!reader.ok()) return;
      const std::size_t size = schema.text.size();
      if (schemas_.emplace(id, std::move(schema)).second) count_schema(size);
    } else if (opcode == Opcode::kChannel) {
      const auto id = reader.number<std::uint16_t>();
      const Schema& schema = schemas_[reader.number<std::uint16_t>()];
      RecordedChannel channel;
      channel.topic = reader.text();
      channel.encoding = reader.text();
      channel.latched = is_latched(reader.map());
      channel.schema_name = schema.name;
      channel.schema_encoding = schema.encoding;
      channel.schema = schema.text;
      if (!reader.ok()) return;
      has_summary_ = has_summary_ || data_ended_;
      if (!numbers_.emplace(id, channels_.size()).second) return;
      count_schema(channel.schema.size());
      channels_.push_back(std::move(channel));
    }
  }

  void count_schema(std::size_t bytes) {
    schema_bytes_ += bytes;
    if (schema_bytes_ > kMostSchemas) {
      throw InputError(fmt::format(
          "{}: the types of its topics are longer than {} MiB", name_, kMostSchemas >> 20));
    }
  }

  void note_loose(std::span<const std::byte> content) {
    const auto message = message_of(content);
    if (!message) return;
    const std::byte* first = content.data() - mcap::kRecordHead;
    if (loose_.records.empty()) {
      loose_.start = loose_.end = message->time;
      loose_.records = {first, mcap::kRecordHead + content.size()};
    }
    loose_.start = std::min(loose_.start, message->time);
    loose_.end = std::max(loose_.end, message->time);
    loose_.records = {loose_.records.data(), content.data() + content.size()};
    auto& channels = loose_.channels;
    if (std::find(channels.begin(), channels.end(), message->channel) == channels.end()) {
      channels.push_back(message->channel);
    }
    if (loose_.records.size() > kLoosePiece) end_loose();
  }
  void end_loose() {
    if (!loose_.records.empty()) pieces_.push_back(std::exchange(loose_, {}));
  }

  void look_into_chunks(const Progress& progress) {
    double done = 0.0;
    for (const Piece& piece : pieces_) {
      report(progress, "looking for topics", done++ / static_cast<double>(pieces_.size()));
      if (!piece.chunk) continue;
      const auto bytes = mcap::unpack(*piece.chunk);
      if (!bytes) continue;
      each_record(*bytes, [&](Opcode opcode, std::span<const std::byte> content) {
        RecordReader reader(content);
        describe(opcode, reader);
        return true;
      });
    }
  }

  const std::string& name_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<ChannelId, std::size_t> numbers_;
  std::vector<RecordedChannel> channels_;
  std::vector<Piece> pieces_;
  std::size_t schema_bytes_ = 0;
  Piece loose_;
  bool data_ended_ = false;
  bool has_summary_ = false;
};

class McapTimeline : public TimedRecording {
 public:
  McapTimeline(std::span<const std::byte> bytes, const std::string& name, const Progress& progress)
      : outline_(records_of(bytes, name), name, progress) {
    const std::vector<Piece>& pieces = outline_.pieces();
    std::int64_t end = std::numeric_limits<std::int64_t>::min();
    for (const Piece& piece : pieces) end = std::max(end, piece.end);
    if (pieces.empty() || outline_.channels().empty()) {
      throw InputError(fmt::format("{}: holds no message", name));
    }
    range_ = {pieces.front().start, end};
  }

  McapTimeline(std::unique_ptr<MappedFile> file, const std::string& name, const Progress& progress)
      : McapTimeline(file->bytes(), name, progress) {
    file_ = std::move(file);
  }

  [[nodiscard]] const std::vector<RecordedChannel>& channels() const override {
    return outline_.channels();
  }
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> range() const override { return range_; }

  void seek(std::int64_t time) override {
    from_ = time;
    next_piece_ = 0;
    waiting_ = {};
    held_.reset();
  }

  bool next(TimedMessage& message) override {
    const std::vector<Piece>& pieces = outline_.pieces();
    for (; next_piece_ < pieces.size(); ++next_piece_) {
      const Piece& piece = pieces[next_piece_];
      if (piece.end < from_) continue;
      const bool is_due = waiting_.empty() || piece.start <= waiting_.top().message.time;
      if (!is_due || (unpacked_bytes_ > kMostUnpacked && !waiting_.empty())) break;
      load(piece);
    }
    if (waiting_.empty()) return false;
    held_ = waiting_.top().bytes;
    const Message& first = waiting_.top().message;
    message = {*outline_.number_of(first.channel), first.time, first.data};
    waiting_.pop();
    return true;
  }

  void latched_before(std::int64_t time,
                      const std::function<void(const TimedMessage&)>& take) override {
    std::set<std::size_t> wanted;
    for (std::size_t i = 0; i < channels().size(); ++i) {
      if (channels()[i].latched) wanted.insert(i);
    }
    const std::vector<Piece>& pieces = outline_.pieces();
    std::vector<std::int64_t> reach;  // the latest end of each piece and all before it
    reach.reserve(pieces.size());
    for (const Piece& piece : pieces) {
      reach.push_back(reach.empty() ? piece.end : std::max(reach.back(), piece.end));
    }
    struct Last {
      Message message;
      Unpacked bytes;
    };
    std::map<std::size_t, Last> last;
    for (std::size_t i = pieces.size(); i-- > 0 && !wanted.empty();) {
      // pieces overlap: one is the last if none that is left comes up to it
      std::erase_if(wanted, [&](std::size_t channel) {
        const auto found = last.find(channel);
        return found != last.end() && found->second.message.time > reach[i];
      });
      if (pieces[i].start > time || !has_one_of(pieces[i], wanted)) continue;
      const Unpacked bytes = unpack(pieces[i]);
      each_message(pieces[i], bytes.get(), [&](const Message& message) {
        const auto channel = outline_.number_of(message.channel);
        if (!channel || !wanted.contains(*channel) || message.time >= time) return;
        const auto known = last.find(*channel);
        if (known == last.end() || message.time >= known->second.message.time) {
          last[*channel] = {message, bytes};
        }
      });
    }
    for (const auto& [channel, found] : last) {
      take({channel, found.message.time, found.message.data});
    }
  }

 private:
  using Unpacked = std::shared_ptr<const std::vector<std::byte>>;
  struct Waiting {
    Message message;
    std::uint64_t order = 0;  ///< Of equal times the first in the file comes first.
    Unpacked bytes;           ///< What it lies in.
    bool operator<(const Waiting& other) const {
      return std::pair(message.time, order) > std::pair(other.message.time, other.order);
    }
  };

  static std::span<const std::byte> records_of(std::span<const std::byte> bytes,
                                               const std::string& name) {
    const auto magic = std::as_bytes(std::span(mcap::kMagic));
    if (bytes.size() < magic.size() || !std::equal(magic.begin(), magic.end(), bytes.begin())) {
      throw InputError(
          fmt::format("{}: is not an MCAP file (it does not begin with its magic)", name));
    }
    return bytes.subspan(magic.size());
  }

  [[nodiscard]] bool has_one_of(const Piece& piece, const std::set<std::size_t>& wanted) const {
    if (piece.channels.empty()) return true;  // who knows
    return std::any_of(piece.channels.begin(), piece.channels.end(), [&](ChannelId id) {
      const auto number = outline_.number_of(id);
      return number && wanted.contains(*number);
    });
  }

  /// Null if there is nothing to unpack, or it does not.
  Unpacked unpack(const Piece& piece) {
    if (!piece.chunk) return nullptr;
    auto bytes = mcap::unpack(*piece.chunk);
    if (!bytes) return nullptr;
    unpacked_bytes_ += bytes->size();
    return {new std::vector<std::byte>(std::move(*bytes)), [this](const auto* gone) {
              unpacked_bytes_ -= gone->size();
              delete gone;
            }};
  }

  template <class Take>
  static void each_message(const Piece& piece,
                           const std::vector<std::byte>* unpacked,
                           const Take& take) {
    const auto bytes = unpacked != nullptr ? std::span(*unpacked) : piece.records;
    each_record(bytes, [&](Opcode opcode, std::span<const std::byte> content) {
      if (opcode != Opcode::kMessage) return true;
      if (const auto message = message_of(content)) take(*message);
      return true;
    });
  }

  void load(const Piece& piece) {
    const auto bytes = unpack(piece);
    each_message(piece, bytes.get(), [&](const Message& message) {
      if (message.time < from_ || !outline_.number_of(message.channel)) return;
      waiting_.push({message, order_++, bytes});
    });
  }

  std::unique_ptr<MappedFile> file_;  ///< None if the bytes are somebody else's.
  Outline outline_;
  std::pair<std::int64_t, std::int64_t> range_;
  std::int64_t from_ = std::numeric_limits<std::int64_t>::min();
  std::size_t next_piece_ = 0;
  std::size_t unpacked_bytes_ = 0;  ///< Of all chunks that are held; outlives them.
  std::priority_queue<Waiting> waiting_;
  std::uint64_t order_ = 0;
  Unpacked held_;  ///< Of the message that was given last.
};

}  // namespace

std::unique_ptr<TimedRecording> open_timed_mcap(const std::string& path, const Progress& progress) {
  return std::make_unique<McapTimeline>(std::make_unique<MappedFile>(path), path, progress);
}

std::unique_ptr<TimedRecording> timed_mcap(std::span<const std::byte> bytes,
                                           const std::string& name,
                                           const Progress& progress) {
  return std::make_unique<McapTimeline>(bytes, name, progress);
}

}  // namespace pointflight
