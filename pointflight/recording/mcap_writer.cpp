#include "pointflight/recording/mcap_writer.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/version.hpp"

namespace pointflight {
namespace {

using mcap::RecordWriter;

std::uint32_t crc_of(std::span<const std::byte> bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
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

/// As chunks say it.
std::string compression_of(const McapOptions& options) {
  const std::string& name = options.compression;
  if (name != "zstd" && name != "lz4" && name != "none") {
    throw InputError(fmt::format("compression '{}' is unknown; zstd, lz4 or none", name));
  }
  return name == "none" ? "" : name;
}

}  // namespace

McapWriter::McapWriter(const std::string& path, const McapOptions& options)
    : options_(options), packer_(compression_of(options)), file_(path) {
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
  RecordWriter record;
  record.record(opcode, content);
  file_.write(record.bytes());
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
  RecordWriter& records = chunk_.records;
  if (records.bytes().empty()) {
    // a chunk by itself is readable: it repeats what its messages need
    for (const auto& schema : schemas_) records.record(Opcode::kSchema, schema);
    for (const auto& channel : channels_) records.record(Opcode::kChannel, channel);
    chunk_.first = chunk_.last = at;
  }
  chunk_.index[id].emplace_back(at, records.bytes().size());
  chunk_.first = std::min(chunk_.first, at);
  chunk_.last = std::max(chunk_.last, at);
  constexpr std::size_t kFields = 2 + 4 + 8 + 8;
  records.head(Opcode::kMessage, kFields + bytes->size())
      .number(id)
      .number(sequences_[id]++)
      .number(at)
      .number(at)
      .raw(*bytes);
  if (messages_++ == 0) first_ = last_ = at;
  first_ = std::min(first_, at);
  last_ = std::max(last_, at);
  if (records.bytes().size() >= options_.chunk_size) end_chunk();
}

void McapWriter::end_chunk() {
  if (chunk_.index.empty()) return;
  const std::uint64_t start = file_.size();
  const std::vector<std::byte>& records = chunk_.records.bytes();
  const std::span<const std::byte> packed = packer_.pack(records);
  RecordWriter fields;
  fields.number(chunk_.first)
      .number(chunk_.last)
      .number(static_cast<std::uint64_t>(records.size()))
      .number(crc_of(records))
      .text(packer_.compression())
      .number(static_cast<std::uint64_t>(packed.size()));
  RecordWriter head;
  head.head(Opcode::kChunk, fields.bytes().size() + packed.size()).raw(fields.bytes());
  file_.write(head.bytes());
  file_.write(packed);
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
      .text(packer_.compression())
      .number(static_cast<std::uint64_t>(packed.size()))
      .number(static_cast<std::uint64_t>(records.size()));
  chunk_indices_.push_back(index.bytes());
  chunk_.records.clear();
  chunk_.index.clear();
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
    for (const auto& content : contents) summary.record(opcode, content);
    RecordWriter offset;
    offset.number(static_cast<std::uint8_t>(opcode))
        .number(from)
        .number(start + summary.bytes().size() - from);
    offsets.record(Opcode::kSummaryOffset, offset.bytes());
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
  summary.head(Opcode::kFooter, kFooterSize).number(start).number(offsets_start);
  summary.number(crc_of(summary.bytes()));
  file_.write(summary.bytes());
}

}  // namespace pointflight
