#include "pointflight/render/direction_order.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pointflight {
namespace {

constexpr int kBits = 9;  // per axis
constexpr std::uint32_t kCells = 1u << kBits;

/// Spreads nine bits to every second place.
std::uint32_t spread(std::uint32_t v) {
  v = (v | v << 8) & 0x00ff00ffu;
  v = (v | v << 4) & 0x0f0f0f0fu;
  v = (v | v << 2) & 0x33333333u;
  return (v | v << 1) & 0x55555555u;
}

std::uint32_t cell_of(const Vector3f& d) {
  const float length = std::abs(d.x()) + std::abs(d.y()) + std::abs(d.z());
  float u = d.x() / length;
  float v = d.y() / length;
  if (d.z() < 0.0f) {
    // the lower half folds outwards
    const float folded = (1.0f - std::abs(v)) * (u < 0.0f ? -1.0f : 1.0f);
    v = (1.0f - std::abs(u)) * (v < 0.0f ? -1.0f : 1.0f);
    u = folded;
  }
  const auto cell = [](float x) {
    const float at = (0.5f + 0.5f * x) * static_cast<float>(kCells);
    // NaN too ends in a cell
    return at >= 0.0f ? std::min(kCells - 1, static_cast<std::uint32_t>(std::min(at, 4096.0f)))
                      : 0u;
  };
  return spread(cell(u)) | spread(cell(v)) << 1;
}

}  // namespace

std::vector<std::uint32_t> direction_order(std::span<const Ray> rays, const Executor& executor) {
  const std::size_t n = rays.size();
  std::vector<std::uint32_t> keys(n);
  executor.parallel_for(n, 8192, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) keys[i] = cell_of(rays[i].direction_world);
  });
  // counting sort by the lower, then by the upper nine bits
  std::vector<std::uint32_t> order(n);
  std::vector<std::uint32_t> other(n);
  for (std::size_t i = 0; i < n; ++i) other[i] = static_cast<std::uint32_t>(i);
  for (const int shift : {0, kBits}) {
    std::array<std::uint32_t, kCells + 1> starts{};
    for (const std::uint32_t key : keys) ++starts[(key >> shift & (kCells - 1)) + 1];
    for (std::size_t c = 0; c < kCells; ++c) starts[c + 1] += starts[c];
    for (const std::uint32_t i : other) order[starts[keys[i] >> shift & (kCells - 1)]++] = i;
    std::swap(order, other);
  }
  return other;
}

}  // namespace pointflight
