// Many draws of a stream at once, by the widest vectors that the processor has.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pointflight {

/// Which draws: those of `RandomStream(seed, stream, entity)`.
struct DrawAddress {
  std::uint64_t seed;
  std::uint32_t stream;
  std::uint32_t entity;
};

/// `RandomStream::uniform2` of `count` indices from `first` on, the same bits.
void draw_uniforms(
    const DrawAddress& address, std::uint64_t first, std::size_t count, double* u, double* v);

/// `RandomStream::normal2`, likewise.
void draw_normals(
    const DrawAddress& address, std::uint64_t first, std::size_t count, double* u, double* v);

}  // namespace pointflight
