#include "pointflight/lidar/stereo.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"

namespace pointflight {
namespace {

/// Neighbours whose disparities differ by no more lie on one surface, which has no gap in the right
/// image; what is nearer by more than this hides what is behind. Pixels.
constexpr double kOneSurface = 1.0;

constexpr double kNothing = -1.0;

/// To the next multiple of 1 / steps.
double rounded(double value, double steps) {
  return steps > 0.0 ? static_cast<double>(floor_to_integer(value * steps + 0.5)) / steps : value;
}

}  // namespace

StereoCamera::StereoCamera(const LidarSettings& lidar)
    : stereo_(lidar.grid.stereo),
      columns_(static_cast<std::size_t>(lidar.grid.columns)),
      rows_(static_cast<std::size_t>(lidar.grid.rows)),
      focal_baseline_(lidar.grid.fx * stereo_.baseline),
      range_min_(lidar.range_min),
      range_max_(lidar.range_max),
      depth_step_(lidar.noise.range_step),
      least_cosine_(math::cos(stereo_.incidence_max_deg * kDegree)),
      nodes_(columns_ / static_cast<std::size_t>(stereo_.window) + 2) {}

/// Largest disparity that each column of the right image sees, of the left's in a row; `kNothing`
/// where it sees none of these surfaces.
std::vector<double> StereoCamera::nearest_in_right(std::span<const double> disparities) const {
  std::vector<double> nearest(columns_, kNothing);
  const auto put = [&](std::int64_t column, double disparity) {
    if (column < 0 || column >= static_cast<std::int64_t>(columns_)) return;
    double& there = nearest[static_cast<std::size_t>(column)];
    there = std::max(there, disparity);
  };
  const auto place = [&](std::size_t u) {
    return floor_to_integer(static_cast<double>(u) - disparities[u] + 0.5);
  };
  for (std::size_t u = 0; u < columns_; ++u) {
    if (disparities[u] < 0.0) continue;
    const std::int64_t here = place(u);
    put(here, disparities[u]);
    if (u + 1 == columns_ || disparities[u + 1] < 0.0) continue;
    if (std::abs(disparities[u + 1] - disparities[u]) > kOneSurface) continue;
    const std::int64_t next = place(u + 1);
    for (std::int64_t between = here + 1; between < next; ++between) {
      put(between, std::min(disparities[u], disparities[u + 1]));
    }
  }
  return nearest;
}

/// Of unit deviation: part of it common to a window (between nodes a window apart, bilinear, scaled
/// to the same deviation everywhere), part of it the pixel's own.
double StereoCamera::noise_at(std::size_t row, std::size_t column, const Draws& draws) const {
  const auto window = static_cast<double>(stereo_.window);
  const double x = static_cast<double>(column) / window;
  const double y = static_cast<double>(row) / window;
  const double i = std::floor(x);
  const double j = std::floor(y);
  const double right = x - i;
  const double down = y - j;
  const std::uint64_t node = static_cast<std::uint64_t>(j) * nodes_ + static_cast<std::uint64_t>(i);
  const auto at = [&](std::uint64_t n) { return draws.windows.normal(draws.image << 32 | n); };
  const double a = (1.0 - right) * (1.0 - down);
  const double b = right * (1.0 - down);
  const double c = (1.0 - right) * down;
  const double d = right * down;
  const double common =
      (a * at(node) + b * at(node + 1) + c * at(node + nodes_) + d * at(node + nodes_ + 1)) /
      std::sqrt(a * a + b * b + c * c + d * d);
  const double own = draws.pixels.normal(draws.image << 32 | (row * columns_ + column));
  const double share = stereo_.white_share;
  return std::sqrt(1.0 - share * share) * common + share * own;
}

void StereoCamera::measure_row(std::size_t row,
                               std::span<const Hit> hits,
                               std::span<const float> shares,
                               const Draws& draws,
                               std::span<Return> returns) const {
  std::vector<double> disparities(columns_, kNothing);
  for (std::size_t u = 0; u < columns_; ++u) {
    if (!hits[u].is_return() || hits[u].range <= 0.0f) continue;
    disparities[u] =
        focal_baseline_ / (static_cast<double>(hits[u].range) * static_cast<double>(shares[u]));
  }
  const std::vector<double> nearest = nearest_in_right(disparities);
  for (std::size_t u = 0; u < columns_; ++u) {
    const double disparity = disparities[u];
    if (disparity < 0.0 || disparity > static_cast<double>(stereo_.disparities)) continue;
    if (static_cast<double>(hits[u].cos_incidence) < least_cosine_) continue;
    const std::int64_t right = floor_to_integer(static_cast<double>(u) - disparity + 0.5);
    if (right < 0 || nearest[static_cast<std::size_t>(right)] > disparity + kOneSurface) continue;
    double seen = disparity;
    if (draws.noise) seen += stereo_.disparity_sigma * noise_at(row, u, draws);
    seen = rounded(seen, static_cast<double>(stereo_.disparity_steps));
    if (seen <= 0.0) continue;
    const double depth =
        rounded(focal_baseline_ / seen, depth_step_ > 0.0 ? 1.0 / depth_step_ : 0.0);
    if (depth < range_min_ || depth > range_max_) continue;
    Return& made = returns[u];
    made.range = static_cast<float>(depth);
    made.true_range = hits[u].range * shares[u];
    made.intensity = hits[u].intensity;
    made.label = hits[u].label;
    made.origin = {hits[u].cos_incidence, hits[u].surfel};
    made.parts = 1;
  }
}

std::vector<Return> StereoCamera::measure(std::span<const Hit> hits,
                                          std::span<const float> shares,
                                          const Draws& draws,
                                          const Executor& executor) const {
  std::vector<Return> returns(hits.size());
  executor.parallel_for(rows_, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      const std::size_t first = row * columns_;
      measure_row(row,
                  hits.subspan(first, columns_),
                  shares.subspan(first, columns_),
                  draws,
                  std::span(returns).subspan(first, columns_));
    }
  });
  return returns;
}

}  // namespace pointflight
