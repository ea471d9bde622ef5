#include "pointflight/recording/internal/mcap_chunk.hpp"

#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cassert>
#include <new>
#include <utility>

namespace pointflight::mcap {
namespace {

constexpr std::uint64_t kLargestChunk = std::uint64_t{1} << 28;  // bytes, unpacked
/// Whatever its packed size; more only if that is no less than a thousandth of it, so that a file
/// of a few KB takes memory of a few MB.
constexpr std::uint64_t kAlwaysTaken = std::uint64_t{1} << 25;
constexpr std::uint64_t kMostGained = 1000;

/// Bytes of a packed chunk; empty if they do not unpack to `size`.
std::vector<std::byte> unpacked(std::span<const std::byte> packed,
                                const std::string& how,
                                std::uint64_t size) {
  std::vector<std::byte> out;
  if (how.empty()) {
    out.assign(packed.begin(), packed.end());
  } else if (how == "zstd") {
    // the frame says its size as well: memory is taken only if both agree
    if (ZSTD_getFrameContentSize(packed.data(), packed.size()) != size) return {};
    out.resize(size);
    if (ZSTD_decompress(out.data(), size, packed.data(), packed.size()) != size) return {};
  } else if (how == "lz4") {
    constexpr std::uint64_t kMostGain = 255;  // of LZ4
    if (size > kMostGain * packed.size()) return {};
    out.resize(size);
    LZ4F_dctx* context = nullptr;
    if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) return {};
    std::size_t to = 0;
    std::size_t from = 0;
    for (;;) {
      std::size_t room = out.size() - to;
      std::size_t taken = packed.size() - from;
      const std::size_t more =
          LZ4F_decompress(context, out.data() + to, &room, packed.data() + from, &taken, nullptr);
      to += room;
      from += taken;
      if (LZ4F_isError(more) != 0 || more == 0 || (room == 0 && taken == 0)) break;
    }
    LZ4F_freeDecompressionContext(context);
    if (to != size) return {};
  }
  return out.size() == size ? out : std::vector<std::byte>{};
}

}  // namespace

void Packer::FreeContext::operator()(ZSTD_CCtx_s* context) const {
  ZSTD_freeCCtx(context);
}

Packer::Packer(std::string compression) : compression_(std::move(compression)) {
  if (compression_ != "zstd") return;
  zstd_.reset(ZSTD_createCCtx());
  if (zstd_ == nullptr) throw std::bad_alloc();
}

std::span<const std::byte> Packer::pack(std::span<const std::byte> bytes) {
  if (compression_.empty()) return bytes;
  const bool is_zstd = compression_ == "zstd";
  const std::size_t most =
      is_zstd ? ZSTD_compressBound(bytes.size()) : LZ4F_compressFrameBound(bytes.size(), nullptr);
  if (packed_.size() < most) packed_.resize(most);
  std::size_t size = 0;
  bool failed = false;
  if (is_zstd) {
    constexpr int kLevel = 1;  // 3 takes twice the time for 2 % on clouds of floats
    size = ZSTD_compressCCtx(
        zstd_.get(), packed_.data(), packed_.size(), bytes.data(), bytes.size(), kLevel);
    failed = ZSTD_isError(size) != 0;
  } else {
    size = LZ4F_compressFrame(packed_.data(), packed_.size(), bytes.data(), bytes.size(), nullptr);
    failed = LZ4F_isError(size) != 0;
  }
  assert(!failed);  // there is room, and nothing else can fail
  return std::span(packed_).first(failed ? 0 : size);
}

std::optional<PackedChunk> chunk_of(RecordReader& record) {
  PackedChunk chunk;
  chunk.start = record.number<std::uint64_t>();
  chunk.end = record.number<std::uint64_t>();
  chunk.size = record.number<std::uint64_t>();
  chunk.crc = record.number<std::uint32_t>();
  chunk.compression = record.text();
  chunk.data = record.take(record.number<std::uint64_t>());
  const std::uint64_t most = std::max(kAlwaysTaken, kMostGained * chunk.data.size());
  if (!record.ok() || chunk.size > std::min(kLargestChunk, most)) return std::nullopt;
  return chunk;
}

std::optional<std::vector<std::byte>> unpack(const PackedChunk& chunk) {
  std::vector<std::byte> bytes = unpacked(chunk.data, chunk.compression, chunk.size);
  if (bytes.size() != chunk.size) return std::nullopt;
  const auto crc = crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  if (chunk.crc != 0 && chunk.crc != crc) return std::nullopt;
  return bytes;
}

}  // namespace pointflight::mcap
