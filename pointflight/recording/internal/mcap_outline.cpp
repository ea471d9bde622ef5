#include "pointflight/recording/internal/mcap_outline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pointflight/core/input_error.hpp"

namespace pointflight::mcap {
namespace {

/// Messages of a file without chunks are loaded so many bytes at a time.
constexpr std::size_t kLoosePiece = std::size_t{4} << 20;

/// Texts of types and topics, each channel's counted: a few KiB in truth.
constexpr std::size_t kMostSchemas = std::size_t{64} << 20;

/// Times count from here on as ns of an int64 that differences fit into.
constexpr std::uint64_t kLatestTime = std::uint64_t{1} << 62;

/// The channel's QoS, as rosbag2 and our writer put it into the metadata: a list in YAML, with
/// durability by its number in rmw (1: transient local) or, since Jazzy, by its name.
bool is_latched(const StringMap& metadata) {
  const auto qos = metadata.find("offered_qos_profiles");
  if (qos == metadata.end()) return false;
  const std::string& text = qos->second;
  return text.find("durability: 1") != std::string::npos ||
         text.find("durability: transient_local") != std::string::npos;
}

}  // namespace

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

Outline::Outline(std::span<const std::byte> bytes,
                 const std::string& name,
                 const Progress& progress)
    : name_(name) {
  const auto magic = std::as_bytes(std::span(kMagic));
  if (bytes.size() < magic.size() || !std::equal(magic.begin(), magic.end(), bytes.begin())) {
    throw InputError(
        fmt::format("{}: is not an MCAP file (it does not begin with its magic)", name));
  }
  info_.format = "MCAP";
  info_.complete = false;  // until its footer is there
  each_record(bytes.subspan(magic.size()), [&](Opcode opcode, std::span<const std::byte> content) {
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

void Outline::note(Opcode opcode, std::span<const std::byte> content) {
  if (opcode == Opcode::kMessage && !data_ended_) return note_loose(content);
  if (opcode != Opcode::kMessageIndex) end_loose();
  RecordReader reader(content);
  if (opcode == Opcode::kChunk && !data_ended_) {
    const auto chunk = chunk_of(reader);
    if (!chunk || chunk->start > chunk->end || chunk->end > kLatestTime) {
      lacks_chunks_ = true;
      return;
    }
    Piece& piece = pieces_.emplace_back();
    piece.start = static_cast<std::int64_t>(chunk->start);
    piece.end = static_cast<std::int64_t>(chunk->end);
    piece.chunk = *chunk;
  } else if (opcode == Opcode::kMessageIndex && !pieces_.empty()) {
    pieces_.back().channels.push_back(reader.number<std::uint16_t>());
  } else if (opcode == Opcode::kDataEnd) {
    data_ended_ = true;
  } else if (opcode == Opcode::kFooter) {
    info_.complete = !lacks_chunks_;
  } else {
    describe(opcode, reader);
  }
}

void Outline::describe(Opcode opcode, RecordReader& reader) {
  if (opcode == Opcode::kHeader) {
    const std::string profile = reader.text();
    info_.format = profile.empty() ? "MCAP" : "MCAP, profile " + profile;
    info_.library = reader.text();
  } else if (opcode == Opcode::kAttachment) {
    static_cast<void>(reader.take(16));  // times
    RecordingInfo::Attachment attachment;
    attachment.name = reader.text();
    attachment.media_type = reader.text();
    attachment.size = reader.number<std::uint64_t>();
    if (reader.ok()) info_.attachments.push_back(std::move(attachment));
  } else if (opcode == Opcode::kSchema) {
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
    count_schema(channel.schema.size() + channel.topic.size() + channel.schema_name.size());
    channels_.push_back(std::move(channel));
  }
}

void Outline::count_schema(std::size_t bytes) {
  schema_bytes_ += bytes;
  if (schema_bytes_ > kMostSchemas) {
    throw InputError(fmt::format(
        "{}: its topics and their types are longer than {} MiB", name_, kMostSchemas >> 20));
  }
}

void Outline::note_loose(std::span<const std::byte> content) {
  const auto message = message_of(content);
  if (!message) return;
  const std::byte* first = content.data() - kRecordHead;
  if (loose_.records.empty()) {
    loose_.start = loose_.end = message->time;
    loose_.records = {first, kRecordHead + content.size()};
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
void Outline::end_loose() {
  if (!loose_.records.empty()) pieces_.push_back(std::exchange(loose_, {}));
}

void Outline::look_into_chunks(const Progress& progress) {
  double done = 0.0;
  for (const Piece& piece : pieces_) {
    report(progress, "looking for topics", done++ / static_cast<double>(pieces_.size()));
    if (!piece.chunk) continue;
    const auto bytes = unpack(*piece.chunk);
    if (!bytes) continue;
    each_record(*bytes, [&](Opcode opcode, std::span<const std::byte> content) {
      RecordReader reader(content);
      describe(opcode, reader);
      return true;
    });
  }
}

}  // namespace pointflight::mcap
