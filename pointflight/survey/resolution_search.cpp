#include "pointflight/survey/resolution_search.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/geometry/types.hpp"

namespace pointflight {
namespace {

constexpr double kFinest = 0.005;  // m
constexpr double kCoarsest = 1.0;  // m

bool is_worse(const TriedResolution& a, const TriedResolution& b) {
  return a.right < b.right;
}

void sort_by_resolution(std::vector<TriedResolution>& tried) {
  std::ranges::sort(tried, {}, &TriedResolution::resolution);
}

}  // namespace

std::vector<TriedResolution> search_resolutions(const TryResolution& try_one, double slack) {
  std::vector<TriedResolution> tried = {try_one(std::nullopt)};
  const TriedResolution start = tried.front();
  if (start.rays == 0) return tried;
  const auto climb = [&](double factor) {
    TriedResolution best = start;
    for (double r = factor * start.resolution; r > kFinest && r < kCoarsest; r *= factor) {
      tried.push_back(try_one(r));
      if (tried.back().right < best.right - slack) break;
      best = std::max(best, tried.back(), is_worse);
    }
    return is_worse(start, best);
  };
  // finer maps take longest
  if (!climb(std::numbers::sqrt2)) climb(1.0 / std::numbers::sqrt2);
  sort_by_resolution(tried);
  return tried;
}

std::vector<TriedResolution> refine_resolutions(std::vector<TriedResolution> tried,
                                                const TryResolution& try_one) {
  if (tried.size() < 2) return tried;
  const auto best = std::max_element(tried.begin(), tried.end(), is_worse);
  std::vector<double> between;
  const auto add = [&](const TriedResolution& a, const TriedResolution& b) {
    between.push_back(std::sqrt(a.resolution * b.resolution));
  };
  if (best + 1 != tried.end()) add(*best, *(best + 1));
  if (best != tried.begin()) add(*(best - 1), *best);
  for (const double resolution : between) tried.push_back(try_one(resolution));
  sort_by_resolution(tried);
  return tried;
}

double best_resolution(const std::vector<TriedResolution>& tried, double level) {
  require_argument(!tried.empty(), "best_resolution: none was tried");
  const double most = std::max_element(tried.begin(), tried.end(), is_worse)->right;
  const auto good = [&](const TriedResolution& one) { return one.right >= most - level; };
  return std::find_if(tried.begin(), tried.end(), good)->resolution;
}

double peak_resolution(const std::vector<TriedResolution>& tried) {
  constexpr double kUsed = 0.02;                       // of the rays
  constexpr double kReach = std::numbers::ln2 + 1e-6;  // an octave
  require_argument(!tried.empty(), "peak_resolution: none was tried");
  const TriedResolution best = *std::max_element(tried.begin(), tried.end(), is_worse);
  Matrix3d products = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  double least = 0.0;
  double most = 0.0;
  int used = 0;
  for (const TriedResolution& one : tried) {
    const double x = math::log(one.resolution / best.resolution);
    if (one.right < best.right - kUsed || std::abs(x) > kReach) continue;
    const Vector3d powers(1.0, x, x * x);
    products += powers * powers.transpose();
    right += (one.right - best.right) * powers;
    least = std::min(least, x);
    most = std::max(most, x);
    ++used;
  }
  if (used < 4) return best.resolution;
  const Vector3d parabola = products.ldlt().solve(right);
  if (!(parabola[2] < 0.0)) return best.resolution;
  const double peak = std::clamp(-0.5 * parabola[1] / parabola[2], least, most);
  return best.resolution * math::exp(peak);
}

}  // namespace pointflight
