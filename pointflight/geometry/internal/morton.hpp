#pragma once

#include <array>
#include <cstdint>

namespace pointflight {

/// Spreads the low 21 bits of `x` to every third bit.
inline std::uint64_t spread_bits3(std::uint64_t x) {
  x &= 0x1fffffu;
  x = (x | x << 32) & 0x1f00000000ffffull;
  x = (x | x << 16) & 0x1f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  x = (x | x << 2) & 0x1249249249249249ull;
  return x;
}

inline std::uint32_t gather_bits3(std::uint64_t x) {
  x &= 0x1249249249249249ull;
  x = (x | x >> 2) & 0x10c30c30c30c30c3ull;
  x = (x | x >> 4) & 0x100f00f00f00f00full;
  x = (x | x >> 8) & 0x1f0000ff0000ffull;
  x = (x | x >> 16) & 0x1f00000000ffffull;
  x = (x | x >> 32) & 0x1fffffull;
  return static_cast<std::uint32_t>(x);
}

/// Morton code of a cell, 21 bits per axis: x in bit 0, y in bit 1, z in bit 2 of each triple.
inline std::uint64_t morton_encode(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  return spread_bits3(x) | spread_bits3(y) << 1 | spread_bits3(z) << 2;
}

inline std::array<std::uint32_t, 3> morton_decode(std::uint64_t code) {
  return {gather_bits3(code), gather_bits3(code >> 1), gather_bits3(code >> 2)};
}

}  // namespace pointflight
