#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pointflight/recording/internal/active_file.hpp"
#include "pointflight/recording/internal/mcap_chunk.hpp"
#include "pointflight/recording/internal/mcap_format.hpp"
#include "pointflight/ros/common/wire.hpp"

namespace pointflight {

/// How the messages are stored.
struct McapOptions {
  std::string compression = "zstd";               ///< or "lz4", "none"
  std::size_t chunk_size = std::size_t{4} << 20;  ///< Bytes before compression.
};

/// Records messages as rosbag2 does: profile "ros2", CDR, schemas "ros2msg", chunks with indices
/// and checksums. Written as `NAME.active`, chunk by chunk; whole chunks survive whatever happens.
/// The same messages give the same bytes.
class McapWriter : public Outlet {
 public:
  /// Throws InputError if the file cannot be written.
  explicit McapWriter(const std::string& path, const McapOptions& options = {});
  ~McapWriter() override;

  [[nodiscard]] Wire wire() const override { return Wire::kCdr; }
  int advertise(const Topic& topic) override;
  [[nodiscard]] bool has_readers(int /*topic*/) const override { return true; }
  void send(int topic, const Bytes& bytes, std::int64_t time) override;
  void close() override;

  /// A file inside the recording, such as the scenario.
  void attach(const std::string& name,
              const std::string& media_type,
              std::string_view text,
              std::int64_t time);

 private:
  using Opcode = mcap::Opcode;
  struct ChunkIndex;

  void write_record(Opcode opcode, std::span<const std::byte> content);
  void end_chunk();
  void write_summary();

  McapOptions options_;
  mcap::Packer packer_;
  ActiveFile file_;
  bool open_ = true;
  std::map<std::string, std::uint16_t> schema_ids_;         ///< By type name.
  std::vector<std::vector<std::byte>> schemas_, channels_;  ///< Their records' contents.
  std::vector<std::uint32_t> sequences_;                    ///< Of each channel.
  std::vector<std::vector<std::byte>> chunk_indices_, attachment_indices_;

  /// The chunk that is being filled. Its memory is kept for the next: to fault in some MB for
  /// each scan took more time than to compress them.
  struct Chunk {
    mcap::RecordWriter records;
    std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> index;
    std::uint64_t first = 0, last = 0;
  } chunk_;
  std::uint64_t messages_ = 0, first_ = 0, last_ = 0;
};

}  // namespace pointflight
