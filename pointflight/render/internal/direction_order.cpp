#include "pointflight/render/internal/direction_order.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pointflight {
namespace {

constexpr int kBits = 12;     // per axis
constexpr int kSortBits = 8;  // a pass
constexpr std::uint32_t kCells = 1u << kBits;

/// Steps of a Hilbert curve over blocks of 8 x 8 cells: from (direction of the curve in the block,
/// x, y) to (number of the cell along it, direction there).
struct HilbertTable {
  std::uint8_t place[4][64];
  std::uint8_t next[4][64];
};

constexpr HilbertTable make_hilbert_table() {
  // one step, by direction and quadrant (2 x + y): number along the curve and direction in it
  constexpr std::uint8_t kPlace[4][4] = {{0, 1, 3, 2}, {0, 3, 1, 2}, {2, 1, 3, 0}, {2, 3, 1, 0}};
  constexpr std::uint8_t kNext[4][4] = {{1, 0, 2, 0}, {0, 3, 1, 1}, {2, 2, 0, 3}, {3, 1, 3, 2}};
  HilbertTable table{};
  for (unsigned direction = 0; direction < 4; ++direction) {
    for (unsigned cell = 0; cell < 64; ++cell) {
      unsigned place = 0;
      unsigned now = direction;
      for (int bit = 2; bit >= 0; --bit) {
        const unsigned quadrant = (cell >> (3 + bit) & 1u) << 1 | (cell >> bit & 1u);
        place = place << 2 | kPlace[now][quadrant];
        now = kNext[now][quadrant];
      }
      table.place[direction][cell] = static_cast<std::uint8_t>(place);
      table.next[direction][cell] = static_cast<std::uint8_t>(now);
    }
  }
  return table;
}

constexpr HilbertTable kHilbert = make_hilbert_table();

std::uint32_t hilbert(std::uint32_t x, std::uint32_t y) {
  std::uint32_t place = 0;
  std::uint32_t direction = 0;
  for (int shift = kBits - 3; shift >= 0; shift -= 3) {
    const std::uint32_t cell = (x >> shift & 7u) << 3 | (y >> shift & 7u);
    place = place << 6 | kHilbert.place[direction][cell];
    direction = kHilbert.next[direction][cell];
  }
  return place;
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
    return at >= 0.0f ? std::min(kCells - 1, static_cast<std::uint32_t>(std::min(at, 65536.0f)))
                      : 0u;
  };
  return hilbert(cell(u), cell(v));
}

template <class DirectionAt>
std::vector<std::uint32_t> order_of(std::size_t n,
                                    const DirectionAt& direction_at,
                                    const Executor& executor) {
  std::vector<std::uint32_t> keys(n);
  executor.parallel_for(n, 8192, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) keys[i] = cell_of(direction_at(i));
  });
  // counting sort, a byte at a time
  std::vector<std::uint32_t> order(n);
  std::vector<std::uint32_t> other(n);
  for (std::size_t i = 0; i < n; ++i) other[i] = static_cast<std::uint32_t>(i);
  constexpr std::uint32_t kBuckets = 1u << kSortBits;
  for (int shift = 0; shift < 2 * kBits; shift += kSortBits) {
    std::array<std::uint32_t, kBuckets + 1> starts{};
    for (const std::uint32_t key : keys) ++starts[(key >> shift & (kBuckets - 1)) + 1];
    for (std::size_t c = 0; c < kBuckets; ++c) starts[c + 1] += starts[c];
    for (const std::uint32_t i : other) order[starts[keys[i] >> shift & (kBuckets - 1)]++] = i;
    std::swap(order, other);
  }
  return other;
}

}  // namespace

std::vector<std::uint32_t> direction_order(std::span<const Ray> rays, const Executor& executor) {
  const auto at = [&](std::size_t i) -> const Vector3f& { return rays[i].direction_world; };
  return order_of(rays.size(), at, executor);
}

std::vector<std::uint32_t> direction_order(std::span<const MapRay> rays, const Executor& executor) {
  const auto at = [&](std::size_t i) {
    const MapRay& ray = rays[i];
    return Vector3f(ray.direction[0], ray.direction[1], ray.direction[2]);
  };
  return order_of(rays.size(), at, executor);
}

std::vector<std::uint32_t> direction_order(std::span<const Vector3f> directions,
                                           const Executor& executor) {
  const auto at = [&](std::size_t i) -> const Vector3f& { return directions[i]; };
  return order_of(directions.size(), at, executor);
}

}  // namespace pointflight
