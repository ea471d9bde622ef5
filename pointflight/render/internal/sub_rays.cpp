#include "pointflight/render/internal/sub_rays.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"

namespace pointflight {
namespace {

constexpr double kRadius = 2.0;  // of the cross-section, sigmas
constexpr double kRim = 2.22;    // `kSubRayRadius`
static_assert(static_cast<float>(kRim) == kSubRayRadius);
constexpr double kGolden = 0.61803398875;  // turns from one to the next
constexpr std::size_t kTurns = 64;

std::array<Turn, kTurns> all_turns() {
  std::array<Turn, kTurns> turns{};
  for (std::size_t i = 0; i < kTurns; ++i) {
    const double angle = 2.0 * kPi * kGolden * static_cast<double>(i);
    turns[i] = {static_cast<float>(math::cos(angle)), static_cast<float>(math::sin(angle))};
  }
  return turns;
}

std::vector<SubRayLanes> in_lanes(const std::vector<SubRay>& sub_rays) {
  std::vector<SubRayLanes> all(sub_rays.size() / 8);
  for (std::size_t i = 0; i < sub_rays.size(); ++i) {
    SubRayLanes& eight = all[i / 8];
    const auto [x, y, share] = sub_rays[i];
    eight.x[i % 8] = x;
    eight.y[i % 8] = y;
    eight.share[i % 8] = share;
  }
  return all;
}

std::vector<SubRayLanes> in_strips(std::size_t count, std::size_t direction) {
  const float x = strip_directions().x[direction];
  const float y = strip_directions().y[direction];
  std::vector<SubRay> sub_rays = spread_sub_rays(count);
  std::stable_sort(sub_rays.begin(), sub_rays.end(), [&](const SubRay& a, const SubRay& b) {
    return a.x * x + a.y * y < b.x * x + b.y * y;
  });
  return in_lanes(sub_rays);
}

}  // namespace

std::vector<SubRay> rim_of_eight() {
  constexpr std::size_t kAround = 7;
  // 1.374 sigma^2 of distance squared
  const double end = 0.5 * kRadius * kRadius;
  const double left = math::exp(-end);
  const double moment = 2.0 * (1.0 - left * (1.0 + end)) / (1.0 - left);
  const double on_rim = moment / (kRim * kRim);
  std::vector<SubRay> sub_rays = {{0.0f, 0.0f, static_cast<float>(1.0 - on_rim)}};
  for (std::size_t i = 0; i < kAround; ++i) {
    const double angle = 2.0 * kPi * static_cast<double>(i) / static_cast<double>(kAround);
    sub_rays.push_back({static_cast<float>(kRim * math::cos(angle)),
                        static_cast<float>(kRim * math::sin(angle)),
                        static_cast<float>(on_rim / static_cast<double>(kAround))});
  }
  return sub_rays;
}

std::vector<SubRay> spread_sub_rays(std::size_t count) {
  struct Seed {
    double x, y, share, angle;
  };
  std::vector<Seed> seeds(count);
  double all = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double r =
        kRadius * std::sqrt((static_cast<double>(i) + 0.5) / static_cast<double>(count));
    const double turns = kGolden * static_cast<double>(i);
    const double angle = 2.0 * kPi * (turns - std::floor(turns));
    seeds[i] = {r * math::cos(angle), r * math::sin(angle), math::exp(-0.5 * r * r), angle};
    all += seeds[i].share;
  }
  std::sort(
      seeds.begin(), seeds.end(), [](const Seed& a, const Seed& b) { return a.angle < b.angle; });
  std::vector<SubRay> sub_rays;
  sub_rays.reserve(count);
  for (const Seed& seed : seeds) {
    sub_rays.push_back({static_cast<float>(seed.x),
                        static_cast<float>(seed.y),
                        static_cast<float>(seed.share / all)});
  }
  return sub_rays;
}

Turn turn_of(std::size_t beam) {
  static const std::array<Turn, kTurns> turns = all_turns();
  return turns[beam % kTurns];
}

const SubRayLanes& first_sub_rays() {
  static const SubRayLanes eight = in_lanes(rim_of_eight())[0];
  return eight;
}

const StripDirections& strip_directions() {
  static const StripDirections directions = [] {
    StripDirections all{};
    for (std::size_t i = 0; i < kStripDirections; ++i) {
      const double angle = kPi * static_cast<double>(i) / static_cast<double>(kStripDirections);
      all.x[i] = static_cast<float>(math::cos(angle));
      all.y[i] = static_cast<float>(math::sin(angle));
    }
    return all;
  }();
  return directions;
}

const std::vector<SubRayLanes>& sub_rays_of_level(std::size_t level, std::size_t direction) {
  using Directions = std::array<std::vector<SubRayLanes>, kStripDirections>;
  static const std::array<Directions, kSubRayLevels> all = [] {
    std::array<Directions, kSubRayLevels> levels;
    for (std::size_t i = 1; i < kSubRayLevels; ++i) {
      for (std::size_t k = 0; k < kStripDirections; ++k)
        levels[i][k] = in_strips(kLevelSizes[i], k);
    }
    return levels;
  }();
  return all[level][direction];
}

}  // namespace pointflight
