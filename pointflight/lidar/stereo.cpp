#include "pointflight/lidar/stereo.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/floor.hpp"
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
/// if it sees none of these surfaces.
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

/// Of a row's pixels, of unit deviation: part of it common to a window (between nodes a window
/// apart, bilinear, scaled to the same deviation everywhere), part of it the pixel's own.
std::vector<double> StereoCamera::noise_of(std::size_t row,
                                           const Draws& draws,
                                           std::span<const double> nodes) const {
  const auto window = static_cast<std::size_t>(stereo_.window);
  const std::span<const double> above = nodes.subspan(row / window * nodes_, nodes_);
  const std::span<const double> below = nodes.subspan((row / window + 1) * nodes_, nodes_);
  const double down = static_cast<double>(row % window) / static_cast<double>(window);
  const double share = stereo_.white_share;
  const double common_share = std::sqrt(1.0 - share * share);
  const std::size_t pairs = (columns_ + 1) / 2;
  std::vector<double> even(pairs);  // of columns 0, 2, ...
  std::vector<double> odd(pairs);
  draws.pixels.normal2(draws.image << 32 | (row * pairs), even, odd);
  std::vector<double> noise(columns_);
  // column by column of all windows: what the four nodes count is the same in each
  for (std::size_t in_window = 0; in_window < window; ++in_window) {
    const double right = static_cast<double>(in_window) / static_cast<double>(window);
    const double a = (1.0 - right) * (1.0 - down);
    const double b = right * (1.0 - down);
    const double c = (1.0 - right) * down;
    const double d = right * down;
    const double deviation = std::sqrt(a * a + b * b + c * c + d * d);
    for (std::size_t u = in_window, i = 0; u < columns_; u += window, ++i) {
      const double common =
          (a * above[i] + b * above[i + 1] + c * below[i] + d * below[i + 1]) / deviation;
      const double own = (u % 2 == 0 ? even : odd)[u / 2];
      noise[u] = common_share * common + share * own;
    }
  }
  return noise;
}

void StereoCamera::measure_row(std::size_t row,
                               std::span<const Hit> hits,
                               std::span<const float> shares,
                               const Draws& draws,
                               std::span<const double> nodes,
                               std::span<Return> returns) const {
  std::vector<double> disparities(columns_, kNothing);
  for (std::size_t u = 0; u < columns_; ++u) {
    if (!hits[u].is_return() || hits[u].range <= 0.0f) continue;
    disparities[u] =
        focal_baseline_ / (static_cast<double>(hits[u].range) * static_cast<double>(shares[u]));
  }
  const std::vector<double> nearest = nearest_in_right(disparities);
  const std::vector<double> noise =
      draws.noise ? noise_of(row, draws, nodes) : std::vector<double>(columns_, 0.0);
  for (std::size_t u = 0; u < columns_; ++u) {
    const double disparity = disparities[u];
    if (disparity < 0.0 || disparity > static_cast<double>(stereo_.disparities)) continue;
    if (static_cast<double>(hits[u].cos_incidence) < least_cosine_) continue;
    const std::int64_t right = floor_to_integer(static_cast<double>(u) - disparity + 0.5);
    if (right < 0 || nearest[static_cast<std::size_t>(right)] > disparity + kOneSurface) continue;
    const double seen = rounded(disparity + stereo_.disparity_sigma * noise[u],
                                static_cast<double>(stereo_.disparity_steps));
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
  // once for all rows: each is a corner of four windows
  std::vector<double> nodes;
  if (draws.noise) {
    nodes.resize(nodes_ * (rows_ / static_cast<std::size_t>(stereo_.window) + 2));
    std::vector<double> unused(nodes.size());
    draws.windows.normal2(draws.image << 32, nodes, unused);
  }
  executor.parallel_for(rows_, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      const std::size_t first = row * columns_;
      measure_row(row,
                  hits.subspan(first, columns_),
                  shares.subspan(first, columns_),
                  draws,
                  nodes,
                  std::span(returns).subspan(first, columns_));
    }
  });
  return returns;
}

}  // namespace pointflight
