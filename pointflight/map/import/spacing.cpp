#include "pointflight/map/import/spacing.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/floor.hpp"
#include "pointflight/core/hash.hpp"
#include "pointflight/geometry/internal/point_tree-inl.hpp"

namespace pointflight {
SpacingEstimate::Block SpacingEstimate::block_of(const Vector3d& point) {
  Block block{};
  for (int axis = 0; axis < 3; ++axis) {
    block[static_cast<std::size_t>(axis)] = floor_to_integer(point[axis] / kBlock);
  }
  return block;
}

bool SpacingEstimate::is_chosen(const Block& block, std::uint64_t one_in) {
  if (one_in == 1) return true;
  std::uint64_t key = 0;
  for (const std::int64_t cell : block) {
    key = key * 0x9e3779b97f4a7c15ull + static_cast<std::uint64_t>(cell);
  }
  return (scatter64(key) & (one_in - 1)) == 0;  // a power of two
}

void SpacingEstimate::add(std::span<const CloudPoint> points, const Executor& executor) {
  // blocks are only ever given up: what is chosen now holds all that will be kept
  constexpr std::size_t kChunk = 8192;
  std::vector<std::vector<std::size_t>> chosen((points.size() + kChunk - 1) / kChunk);
  executor.parallel_for(points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    Block last{};
    bool last_is_chosen = is_chosen(last, one_in_);
    for (std::size_t i = begin; i < end; ++i) {
      const Vector3d& p = points[i].position;
      if (!(p.cwiseAbs().maxCoeff() < 1e12)) continue;
      const Block block = block_of(p);
      if (block != last) last_is_chosen = is_chosen(block, one_in_);
      last = block;
      if (last_is_chosen) chosen[begin / kChunk].push_back(i);
    }
  });
  for (const auto& indices : chosen) {
    for (const std::size_t i : indices) keep(points[i].position);
  }
}

void SpacingEstimate::keep(const Vector3d& point) {
  if (!is_chosen(block_of(point), one_in_)) return;
  kept_.push_back(point);
  // a single block may hold more than all of them: then keep what came first
  while (kept_.size() > kMaxPoints && one_in_ < (1u << 20)) {
    one_in_ *= 2;
    std::erase_if(kept_, [&](const Vector3d& p) { return !is_chosen(block_of(p), one_in_); });
    if (kept_.empty()) kept_.push_back(point);
  }
  if (kept_.size() > 2 * kMaxPoints) kept_.pop_back();
}

double SpacingEstimate::median_spacing() const {
  constexpr std::size_t kMaxQueries = 20000;
  // the same point given twice (overlapping files) says nothing of the spacing
  std::vector<Vector3d> distinct = kept_;
  const auto less = [](const Vector3d& a, const Vector3d& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  };
  std::sort(distinct.begin(), distinct.end(), less);
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  if (distinct.size() < 20) return 0.0;
  const PointTree<Vector3d> tree(std::move(distinct));
  const std::size_t count = tree.points().size();
  const std::size_t stride = std::max<std::size_t>(1, count / kMaxQueries);
  std::vector<double> spacing;
  for (std::size_t i = 0; i < count; i += stride) {
    const double squared = tree.squared_spacing(i);
    if (squared > 1e-12) spacing.push_back(std::sqrt(squared));
  }
  if (spacing.empty()) return 0.0;
  const auto middle = spacing.begin() + static_cast<std::ptrdiff_t>(spacing.size() / 2);
  std::nth_element(spacing.begin(), middle, spacing.end());
  return *middle;
}

Vector3d SpacingEstimate::middle() const {
  Vector3d middle = Vector3d::Zero();
  std::vector<double> values(kept_.size());
  for (int axis = 0; axis < 3 && !kept_.empty(); ++axis) {
    for (std::size_t i = 0; i < kept_.size(); ++i) values[i] = kept_[i][axis];
    const auto half = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), half, values.end());
    middle[axis] = *half;
  }
  return middle;
}

double supported_resolution(double spacing) {
  const double wanted = 2.0 * spacing;
  if (!(wanted > 1e-9) || !(wanted < 1e12)) return 0.0;
  // steps of the second digit, without logarithms; 36 / 1000 is 0.036, 36 * 0.001 is not
  double divisor = 1.0;
  double factor = 1.0;
  while (wanted * divisor < 10.0) divisor *= 10.0;
  while (wanted / factor >= 100.0) factor *= 10.0;
  return std::ceil(wanted * divisor / factor - 1e-9) * factor / divisor;
}

}  // namespace pointflight
