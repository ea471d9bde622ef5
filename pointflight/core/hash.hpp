#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace pointflight {

/// XXH3, 64 bits: the checksum of `.pfmap` sections.
std::uint64_t hash64(std::span<const std::byte> bytes);

/// Scatters the bits of a number (Murmur3's finaliser): close ones come out far apart.
inline std::uint64_t scatter64(std::uint64_t h) {
  h ^= h >> 33;
  h *= 0xff51afd7ed558ccdull;
  h ^= h >> 33;
  h *= 0xc4ceb9fe1a85ec53ull;
  h ^= h >> 33;
  return h;
}

}  // namespace pointflight
