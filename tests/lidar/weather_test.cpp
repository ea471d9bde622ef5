#include "pointflight/lidar/weather.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/lidar/return_model.hpp"
#include "tests/lidar/one_beam.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

constexpr double kDivergence = 0.2 * kDegree;
constexpr double kPulse = 8e-9;

Weather of(WeatherKind kind, double figure, double nearest = 0.1, double reach = 100.0) {
  WeatherSettings settings;
  settings.kind = kind;
  settings.visibility = figure;
  settings.rate = figure;
  return {settings, kDivergence, kPulse, nearest, reach};
}

TEST(Weather, ExtinctionIsThatOfItsSources) {
  EXPECT_NEAR(of(WeatherKind::kFog, 50.0).extinction(), std::log(20.0) / 50.0, 1e-12);
  EXPECT_NEAR(of(WeatherKind::kDust, 100.0).extinction(), std::log(20.0) / 100.0, 1e-12);
  // Marshall and Palmer's drops, Q = 2: 3.65e-4 R^0.63
  EXPECT_NEAR(of(WeatherKind::kRain, 10.0).extinction(), 3.65e-4 * std::pow(10.0, 0.63), 5e-6);
  EXPECT_NEAR(of(WeatherKind::kRain, 50.0).extinction(), 3.65e-4 * std::pow(50.0, 0.63), 2e-5);
  // snow by adding up its flakes' cross sections
  const double rate = 5.0;
  const double n0 = 7600.0 * std::pow(rate, -0.87);
  const double steepness = 2.55 * std::pow(rate, -0.48);
  double sum = 0.0;
  const double step = 1e-3;  // mm
  for (double d = 0.5 * step; d < 60.0; d += step) {
    sum += 2.0 * kPi / 4.0 * d * d * 1e-6 * n0 * std::exp(-steepness * d) * step;
  }
  EXPECT_NEAR(of(WeatherKind::kSnow, rate).extinction() / sum, 1.0, 1e-3);
  EXPECT_TRUE(of(WeatherKind::kClear, 10.0).is_clear());
  EXPECT_EQ(of(WeatherKind::kClear, 10.0).target(0.5, 10.0), 0.5 / 100.0);
}

TEST(Weather, FogGivesBackThePulsesIntegral) {
  const double visibility = 40.0;
  const Weather fog = of(WeatherKind::kFog, visibility);
  const double alpha = std::log(20.0) / visibility;
  const double beta = 0.046 / visibility;
  // over time, in steps of 10 ps, at ranges of 1 cm
  const auto signal = [&](double range) {
    double sum = 0.0;
    const double dt = 1e-11;
    for (double t = 0.5 * dt; t < 2.0 * kPulse; t += dt) {
      const double r = range - 0.5 * 299792458.0 * t;
      if (r <= 0.9) break;
      const double xi = std::min(1.0, (r - 0.9) / 0.1);
      const double pulse = std::pow(std::sin(kPi * t / (2.0 * kPulse)), 2);
      sum += pulse * std::exp(-2.0 * alpha * r) * xi / (r * r) * 0.5 * 299792458.0 * dt;
    }
    return kPi * beta * sum;
  };
  double best = 0.0;
  double place = 0.0;
  for (double range = 1.0; range < 12.0; range += 0.02) {
    if (signal(range) <= best) continue;
    best = signal(range);
    place = range;
  }
  const auto soft = fog.soft(30.0, 0.5, 0.5);
  ASSERT_TRUE(soft);
  EXPECT_NEAR(soft->strength / best, 1.0, 0.02);
  EXPECT_NEAR(soft->range, place, 1.0);  // within its peak
  // a wall in the way of the peak leaves what lies before it
  const auto before = fog.soft(2.0, 0.5, 0.5);
  ASSERT_TRUE(before);
  EXPECT_LE(before->range, 2.0);
  EXPECT_NEAR(before->strength / signal(2.0), 1.0, 0.05);
}

/// The strongest of drops that are scattered one by one.
struct Strongest {
  double strength = 0.0, range = 0.0;
};
Strongest scattered(const RandomStream& random, std::uint64_t trial, double rate, double reach) {
  const double steepness = 4.1 * std::pow(rate, -0.21);
  const double density = 8000.0 / steepness * std::exp(-steepness * 0.05);  // of those that count
  const double alpha = 1e-6 * kPi * 8000.0 / std::pow(steepness, 3);
  const double fresnel = std::pow(0.328 / 2.328, 2);
  const auto volume = [](double r) { return kPi / 3.0 * r * std::pow(0.5 * kDivergence * r, 2); };
  const double first = 0.9;
  const double expected = density * (volume(reach) - volume(first));
  Strongest best;
  // a Poisson number: intervals of an exponential until they pass the expected number
  double passed = 0.0;
  for (std::uint64_t i = 0;; ++i) {
    const auto [a, b] = random.uniform2(trial << 16 | (2 * i));
    const double c = random.uniform(trial << 16 | (2 * i + 1));
    passed -= std::log(1.0 - a);
    if (passed > expected) return best;
    const double r = std::cbrt(std::pow(first, 3) + c * (std::pow(reach, 3) - std::pow(first, 3)));
    const double diameter = 0.05 - std::log(1.0 - b) / steepness;
    const double beam = 1e3 * kDivergence * r;
    const double strength = fresnel * std::min(1.0, std::pow(diameter / beam, 2)) *
                            std::exp(-2.0 * alpha * r) / (r * r);
    if (strength > best.strength) best = {strength, r};
  }
}

TEST(Weather, TheStrongestDropIsAsOfDropsScatteredOneByOne) {
  const double rate = 30.0;
  const double reach = 30.0;
  const Weather rain = of(WeatherKind::kRain, rate);
  const RandomStream random(1, StreamId::kTest, 0);
  constexpr std::uint64_t kTrials = 4000;
  std::vector<double> drawn, counted, drawn_ranges, counted_ranges;
  for (std::uint64_t i = 0; i < kTrials; ++i) {
    const Strongest one = scattered(random, i, rate, reach);
    if (one.strength > 0.0) {
      counted.push_back(std::log(one.strength));
      counted_ranges.push_back(one.range);
    }
    const auto [a, b] = random.uniform2((std::uint64_t{1} << 60) + i);
    if (const auto soft = rain.soft(reach, a, b)) {
      drawn.push_back(std::log(soft->strength));
      drawn_ranges.push_back(soft->range);
    }
  }
  EXPECT_NEAR(static_cast<double>(drawn.size()), static_cast<double>(counted.size()), 60.0);
  const auto quantile = [](std::vector<double>& values, double share) {
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  for (const double share : {0.05, 0.25, 0.5, 0.75, 0.95}) {
    EXPECT_NEAR(quantile(drawn, share), quantile(counted, share), 0.15) << share;
    EXPECT_NEAR(quantile(drawn_ranges, share) / quantile(counted_ranges, share), 1.0, 0.15)
        << share;
  }
}

/// Share of 20,000 beams at a wall that report it, and share that report the air.
std::pair<double, double> shares(const Surroundings& around, double range, double filter = 0.0) {
  LidarSettings lidar = load_lidar("mid360");
  lidar.detection.air_filter = filter;
  const ReturnModel model(lidar, around);
  const RandomStream random(3, StreamId::kTest, 1);
  Hit wall;
  wall.range = static_cast<float>(range);
  wall.cos_incidence = 1.0f;
  int of_wall = 0;
  int of_air = 0;
  constexpr int kBeams = 20000;
  for (std::uint64_t i = 0; i < kBeams; ++i) {
    const auto [normal, unused] = random.normal2(3 * i);
    const auto [detection, place] = random.uniform2(3 * i + 1);
    const auto [drop, drop_position] = random.uniform2(3 * i + 2);
    const Return made =
        testing::measured(model, wall, {normal, detection, place, drop, drop_position});
    if (made.range < 0.0f) continue;
    (made.label == kFalseReturn ? of_air : of_wall)++;
  }
  return {static_cast<double>(of_wall) / kBeams, static_cast<double>(of_air) / kBeams};
}

TEST(Weather, FogHidesWallsAndReturnsItself) {
  Surroundings clear;
  Surroundings thin;
  thin.weather = {WeatherKind::kFog, 400.0, 0.0};
  Surroundings thick;
  thick.weather = {WeatherKind::kFog, 30.0, 0.0};
  EXPECT_GT(shares(clear, 20.0).first, 0.99);
  EXPECT_LT(shares(clear, 20.0).second, 0.001);
  EXPECT_GT(shares(thin, 20.0).first, 0.95);
  EXPECT_LT(shares(thick, 20.0).first, 0.01);
  EXPECT_GT(shares(thick, 20.0).second, 0.9);
  EXPECT_GT(shares(thick, 2.0).first, 0.99);  // still seen from near
}

TEST(Weather, AFilterTakesTheAirOutAndLeavesTheWall) {
  Surroundings fog;
  fog.weather = {WeatherKind::kFog, 100.0, 0.0};
  EXPECT_GT(load_lidar("mid360").detection.air_filter, 0.9);
  const auto [bare_wall, bare_air] = shares(fog, 20.0);
  EXPECT_LT(bare_wall, 0.05);
  EXPECT_GT(bare_air, 0.9);
  const auto [wall, air] = shares(fog, 20.0, 0.95);
  EXPECT_NEAR(air, 0.05 * bare_air, 0.01);
  EXPECT_GT(wall, 0.85);  // its own signal is strong enough
}

TEST(Weather, RainDisturbsAFewBeams) {
  Surroundings rain;
  rain.weather = {WeatherKind::kRain, 0.0, 30.0};
  const auto [wall, air] = shares(rain, 20.0);
  EXPECT_GT(wall, 0.8);
  EXPECT_GT(air, 0.001);
  EXPECT_LT(air, 0.15);
}

}  // namespace
}  // namespace pointflight
