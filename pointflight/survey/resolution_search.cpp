#include "pointflight/survey/resolution_search.hpp"

#include <algorithm>
#include <numbers>

#include "pointflight/core/argument.hpp"

namespace pointflight {
namespace {

constexpr double kFinest = 0.005;  // m
constexpr double kCoarsest = 1.0;  // m
constexpr double kLevel = 0.003;   // of the rays

bool is_worse(const TriedResolution& a, const TriedResolution& b) {
  return a.right < b.right;
}

}  // namespace

std::vector<TriedResolution> search_resolutions(const TryResolution& try_one) {
  std::vector<TriedResolution> tried = {try_one(std::nullopt)};
  const TriedResolution start = tried.front();
  if (start.rays == 0) return tried;
  const auto climb = [&](double factor) {
    TriedResolution last = start;
    for (double r = factor * start.resolution; r > kFinest && r < kCoarsest; r *= factor) {
      tried.push_back(try_one(r));
      if (is_worse(tried.back(), last)) break;
      last = tried.back();
    }
    return is_worse(start, last);
  };
  // finer maps take longest
  if (!climb(std::numbers::sqrt2)) climb(1.0 / std::numbers::sqrt2);
  std::sort(tried.begin(), tried.end(), [](const TriedResolution& a, const TriedResolution& b) {
    return a.resolution < b.resolution;
  });
  return tried;
}

double best_resolution(const std::vector<TriedResolution>& tried) {
  require_argument(!tried.empty(), "best_resolution: none was tried");
  const double most = std::max_element(tried.begin(), tried.end(), is_worse)->right;
  const auto good = [&](const TriedResolution& one) { return one.right >= most - kLevel; };
  return std::find_if(tried.begin(), tried.end(), good)->resolution;
}

}  // namespace pointflight
