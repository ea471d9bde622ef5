#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pointflight/recording/internal/mcap_format.hpp"

struct ZSTD_CCtx_s;

namespace pointflight::mcap {

/// Compresses chunks, one after another; keeps its memory.
class Packer {
 public:
  /// "", "lz4", "zstd"
  explicit Packer(std::string compression);

  /// As chunks say it.
  [[nodiscard]] const std::string& compression() const { return compression_; }

  /// Compressed, until the next call; without a compression `bytes` themselves.
  [[nodiscard]] std::span<const std::byte> pack(std::span<const std::byte> bytes);

 private:
  struct FreeContext {
    void operator()(ZSTD_CCtx_s* context) const;
  };

  std::string compression_;
  std::unique_ptr<ZSTD_CCtx_s, FreeContext> zstd_;
  std::vector<std::byte> packed_;
};

/// A chunk as it lies in a file, of a record's content.
struct PackedChunk {
  /// ns, of its first and last message, as it says itself.
  ///@{
  std::uint64_t start = 0, end = 0;
  ///@}
  std::uint64_t size = 0;           ///< Bytes, unpacked.
  std::uint32_t crc = 0;            ///< Of them; 0: not known.
  std::string compression;          ///< "", "lz4", "zstd"
  std::span<const std::byte> data;  ///< Packed.
};

/// Nothing if the record is cut, or claims more than is taken.
std::optional<PackedChunk> chunk_of(RecordReader& record);

/// Its records; nothing if they do not unpack to the size and the checksum that it says.
std::optional<std::vector<std::byte>> unpack(const PackedChunk& chunk);

}  // namespace pointflight::mcap
