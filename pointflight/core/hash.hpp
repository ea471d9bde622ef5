#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace pointflight {

/// XXH3, 64 bits: the checksum of `.pfmap` sections.
std::uint64_t hash64(std::span<const std::byte> bytes);

}  // namespace pointflight
