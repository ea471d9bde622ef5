#include "pointflight/core/hash.hpp"

#include <xxhash.h>

namespace pointflight {

std::uint64_t hash64(std::span<const std::byte> bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

}  // namespace pointflight
