#include "pointflight/recording/mcap_writer.hpp"

#include <fmt/format.h>
#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cassert>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/version.hpp"

namespace pointflight {
namespace {

using mcap::RecordWriter;

std::uint32_t crc_of(std::span<const std::byte> bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::vector<std::byte> compressed(std::span<const std::byte> bytes, const std::string& how) {
  std::vector<std::byte> out;
  std::size_t size = 0;
  bool failed = false;
  if (how == "zstd") {
    constexpr int kLevel = 1;  // 3 takes twice the time for 2 % on clouds of floats
    out.resize(ZSTD_compressBound(bytes.size()));
    size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kLevel);
    failed = ZSTD_isError(size) != 0;
  } else {
    out.resize(LZ4F_compressFrameBound(bytes.size(), nullptr));
    size = LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr);
    failed = LZ4F_isError(size) != 0;
  }
  assert(!failed);  // there is room, and nothing else can fail
  out.resize(failed ? 0 : size);
  return out;
}

/// How rosbag2 notes a writer's quality of service (integers: Humble's form, which all read).
std::string qos_yaml(const Topic& topic) {
  return fmt::format(
      "- history: 1\n  depth: {}\n  reliability: 1\n  durability: {}\n  deadline:\n    sec: "
      "9223372036\n    nsec: 854775807\n  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  "
      "liveliness: 1\n  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n  "
      "avoid_ros_namespace_conventions: false",
      topic.depth,
      topic.latched ? 1 : 2);
}

/// A record with its head.
std::vector<std::byte> record_of(mcap::Opcode opcode, std::span<const std::byte> content) {
  RecordWriter record;
  record.number(static_cast<std::uint8_t>(opcode))
      .number(static_cast<std::uint64_t>(content.size()))
      .raw(content);
  return record.bytes();
}

}  // namespace

McapWriter::McapWriter(const std::string& path, const McapOptions& options)
    : options_(options), file_(path) {
  if (options_.compression == "none") options_.compression.clear();
  if (!options_.compression.empty() && options_.compression != "zstd" &&
      options_.compression != "lz4") {
    throw InputError(
        fmt::format("compression '{}' is unknown; zstd, lz4 or none", options_.compression));
  }
  try {
    file_.write(std::as_bytes(std::span(mcap::kMagic)));
    RecordWriter header;
    header.text("ros2").text(fmt::format("pointflight {}", kVersion));
    write_record(Opcode::kHeader, header.bytes());
    file_.flush();
  } catch (const InputError&) {
    file_.discard();
    throw;
  }
}

McapWriter::~McapWriter() {
  try {
    end_chunk();  // without `close` the file stays active, with all that came
  } catch (const InputError&) {
    // the disk is full: what lies there is all there will be
  }
}

void McapWriter::write_record(Opcode opcode, std::span<const std::byte> content) {
  file_.write(record_of(opcode, content));
}

int McapWriter::advertise(const Topic& topic) {
  const std::string name = topic.type.ros2_name();
  const auto [schema, is_new] =
      schema_ids_.try_emplace(name, static_cast<std::uint16_t>(schema_ids_.size() + 1));
  if (is_new) {
    RecordWriter record;
    record.number(schema->second).text(name).text("ros2msg").text(topic.type.ros2_definition);
    schemas_.push_back(record.bytes());
    write_record(Opcode::kSchema, schemas_.back());
  }
  const auto id = static_cast<std::uint16_t>(channels_.size());
  RecordWriter record;
  record.number(id)
      .number(schema->second)
      .text(topic.name)
      .text("cdr")
      .map({{"offered_qos_profiles", qos_yaml(topic)}, {"topic_type_hash", topic.type.hash}});
  channels_.push_back(record.bytes());
  write_record(Opcode::kChannel, channels_.back());
  sequences_.push_back(0);
  return id;
}

void McapWriter::send(int topic, const Bytes& bytes, std::int64_t time) {
  if (!open_) return;
  const auto id = static_cast<std::uint16_t>(topic);
  const auto at = static_cast<std::uint64_t>(time);
  if (chunk_.records.empty()) {
    // a chunk by itself is readable: it repeats what its messages need
    for (const auto& schema : schemas_) {
      const auto record = record_of(Opcode::kSchema, schema);
      chunk_.records.insert(chunk_.records.end(), record.begin(), record.end());
    }
    for (const auto& channel : channels_) {
      const auto record = record_of(Opcode::kChannel, channel);
      chunk_.records.insert(chunk_.records.end(), record.begin(), record.end());
    }
    chunk_.first = chunk_.last = at;
  }
  chunk_.index[id].emplace_back(at, chunk_.records.size());
  chunk_.first = std::min(chunk_.first, at);
  chunk_.last = std::max(chunk_.last, at);
  RecordWriter message;
  message.number(id).number(sequences_[id]++).number(at).number(at).raw(*bytes);
  const auto record = record_of(Opcode::kMessage, message.bytes());
  chunk_.records.insert(chunk_.records.end(), record.begin(), record.end());
  if (messages_++ == 0) first_ = last_ = at;
  first_ = std::min(first_, at);
  last_ = std::max(last_, at);
  if (chunk_.records.size() >= options_.chunk_size) end_chunk();
}

void McapWriter::end_chunk() {
  if (chunk_.index.empty()) return;
  const std::uint64_t start = file_.size();
  const auto packed = options_.compression.empty()
                          ? chunk_.records
                          : compressed(chunk_.records, options_.compression);
  RecordWriter chunk;
  chunk.number(chunk_.first)
      .number(chunk_.last)
      .number(static_cast<std::uint64_t>(chunk_.records.size()))
      .number(crc_of(chunk_.records))
      .text(options_.compression)
      .number(static_cast<std::uint64_t>(packed.size()))
      .raw(packed);
  write_record(Opcode::kChunk, chunk.bytes());
  const std::uint64_t length = file_.size() - start;

  RecordWriter offsets;
  for (const auto& [channel, entries] : chunk_.index) {
    offsets.number(channel).number(file_.size());
    RecordWriter list;
    for (const auto& [time, offset] : entries) list.number(time).number(offset);
    RecordWriter index;
    index.number(channel).number(static_cast<std::uint32_t>(list.bytes().size())).raw(list.bytes());
    write_record(Opcode::kMessageIndex, index.bytes());
  }
  file_.flush();

  RecordWriter index;
  index.number(chunk_.first)
      .number(chunk_.last)
      .number(start)
      .number(length)
      .number(static_cast<std::uint32_t>(offsets.bytes().size()))
      .raw(offsets.bytes())
      .number(file_.size() - start - length)
      .text(options_.compression)
      .number(static_cast<std::uint64_t>(packed.size()))
      .number(static_cast<std::uint64_t>(chunk_.records.size()));
  chunk_indices_.push_back(index.bytes());
  chunk_ = Chunk{};
}

void McapWriter::attach(const std::string& name,
                        const std::string& media_type,
                        std::string_view text,
                        std::int64_t time) {
  const auto at = static_cast<std::uint64_t>(time);
  RecordWriter record;
  record.number(at)
      .number(at)
      .text(name)
      .text(media_type)
      .number(static_cast<std::uint64_t>(text.size()))
      .raw(std::as_bytes(std::span(text.data(), text.size())));
  record.number(crc_of(record.bytes()));
  const std::uint64_t start = file_.size();
  write_record(Opcode::kAttachment, record.bytes());
  file_.flush();
  RecordWriter index;
  index.number(start)
      .number(file_.size() - start)
      .number(at)
      .number(at)
      .number(static_cast<std::uint64_t>(text.size()))
      .text(name)
      .text(media_type);
  attachment_indices_.push_back(index.bytes());
}

void McapWriter::close() {
  if (!open_) return;
  end_chunk();
  open_ = false;
  RecordWriter end;
  end.number(std::uint32_t{0});  // of the data section: not computed; each chunk has its own
  write_record(Opcode::kDataEnd, end.bytes());
  write_summary();
  file_.write(std::as_bytes(std::span(mcap::kMagic)));
  file_.commit();
}

void McapWriter::write_summary() {
  const std::uint64_t start = file_.size();
  RecordWriter summary;
  RecordWriter offsets;
  const auto group = [&](Opcode opcode, const std::vector<std::vector<std::byte>>& contents) {
    if (contents.empty()) return;
    const std::uint64_t from = start + summary.bytes().size();
    for (const auto& content : contents) summary.raw(record_of(opcode, content));
    RecordWriter offset;
    offset.number(static_cast<std::uint8_t>(opcode))
        .number(from)
        .number(start + summary.bytes().size() - from);
    offsets.raw(record_of(Opcode::kSummaryOffset, offset.bytes()));
  };
  RecordWriter counts;
  for (std::size_t i = 0; i < sequences_.size(); ++i) {
    if (sequences_[i] == 0) continue;
    counts.number(static_cast<std::uint16_t>(i)).number(static_cast<std::uint64_t>(sequences_[i]));
  }
  RecordWriter statistics;
  statistics.number(messages_)
      .number(static_cast<std::uint16_t>(schemas_.size()))
      .number(static_cast<std::uint32_t>(channels_.size()))
      .number(static_cast<std::uint32_t>(attachment_indices_.size()))
      .number(std::uint32_t{0})
      .number(static_cast<std::uint32_t>(chunk_indices_.size()))
      .number(first_)
      .number(last_)
      .number(static_cast<std::uint32_t>(counts.bytes().size()))
      .raw(counts.bytes());
  group(Opcode::kSchema, schemas_);
  group(Opcode::kChannel, channels_);
  group(Opcode::kStatistics, {statistics.bytes()});
  group(Opcode::kChunkIndex, chunk_indices_);
  group(Opcode::kAttachmentIndex, attachment_indices_);
  const std::uint64_t offsets_start = start + summary.bytes().size();
  summary.raw(offsets.bytes());
  // the checksum covers the footer up to itself
  constexpr std::uint64_t kFooterSize = 8 + 8 + 4;
  summary.number(static_cast<std::uint8_t>(Opcode::kFooter))
      .number(kFooterSize)
      .number(start)
      .number(offsets_start);
  summary.number(crc_of(summary.bytes()));
  file_.write(summary.bytes());
}

}  // namespace pointflight
