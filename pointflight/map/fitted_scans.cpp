#include "pointflight/map/fitted_scans.hpp"

#include <algorithm>
#include <cstring>
#include <span>

namespace pointflight {
namespace {

std::vector<std::uint64_t> numbers_in(std::span<const std::byte> section) {
  std::vector<std::uint64_t> numbers(section.size() / sizeof(std::uint64_t));
  if (!numbers.empty()) {
    std::memcpy(numbers.data(), section.data(), numbers.size() * sizeof(std::uint64_t));
  }
  return numbers;
}

}  // namespace

void add_fitted_scans(MapDescription& description, std::vector<std::uint64_t> fingerprints) {
  for (const ExtraSection& section : description.extra) {
    if (section.name != kFittedSection) continue;
    const std::vector<std::uint64_t> earlier = numbers_in(section.bytes);
    fingerprints.insert(fingerprints.end(), earlier.begin(), earlier.end());
  }
  std::sort(fingerprints.begin(), fingerprints.end());
  fingerprints.erase(std::unique(fingerprints.begin(), fingerprints.end()), fingerprints.end());
  const auto bytes = std::as_bytes(std::span(fingerprints));
  set_section(description, kFittedSection, {bytes.begin(), bytes.end()});
}

std::vector<std::uint64_t> fitted_scans(const SurfelMap& map) {
  return numbers_in(map.section(kFittedSection));
}

}  // namespace pointflight
