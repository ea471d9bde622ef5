#include "pointflight/world/wind.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <vector>

#include "pointflight/core/constants.hpp"

namespace pointflight {
namespace {

/// One-sided power spectral density at angular frequency w, Hann windows of `length` samples.
double density(const std::vector<double>& x, double dt, std::size_t length, double w) {
  std::vector<std::complex<double>> kernel;
  double power = 0.0;
  for (std::size_t i = 0; i < length; ++i) {
    const double at = (static_cast<double>(i) + 0.5) / static_cast<double>(length);
    const double window = 0.5 - 0.5 * std::cos(2 * kPi * at);
    kernel.push_back(window * std::polar(1.0, -w * static_cast<double>(i) * dt));
    power += window * window;
  }
  double sum = 0.0;
  int count = 0;
  for (std::size_t first = 0; first + length <= x.size(); first += length / 2, ++count) {
    std::complex<double> transform = 0.0;
    for (std::size_t i = 0; i < length; ++i) transform += kernel[i] * x[first + i];
    sum += std::norm(transform) * dt / (kPi * power);
  }
  return sum / count;
}

TEST(Wind, GustsHaveDrydensSpectra) {
  WindSettings settings;
  settings.turbulence = Turbulence::kCustom;
  settings.gust_sigma = {1.5, 1.0, 0.7};
  settings.gust_length = {40.0, 25.0, 10.0};
  const Wind wind(settings, 5);
  constexpr double kStep = 0.05;
  constexpr double kAirspeed = 10.0;
  GustState state;
  std::vector<double> x[3];
  for (std::uint64_t i = 0; i < 2500000; ++i) {
    const Vector3d w = wind.over_step(state, 0, i, kStep, {kAirspeed, 0, 0}, 100.0);
    for (int axis = 0; axis < 3; ++axis) x[axis].push_back(w[axis]);
  }
  for (int axis = 0; axis < 3; ++axis) {
    SCOPED_TRACE(axis);
    const double sigma = settings.gust_sigma[axis];
    const double time = settings.gust_length[axis] / kAirspeed;
    double square = 0.0;
    for (const double v : x[axis]) square += v * v / static_cast<double>(x[axis].size());
    EXPECT_NEAR(std::sqrt(square), sigma, 0.04 * sigma);
    for (const double share : {0.1, 0.3, 0.6, 1.0, 2.0, 4.0, 8.0}) {
      const double w = share / time;
      const double lw = time * w;
      const double formula =
          axis == 0 ? sigma * sigma * 2.0 * time / kPi / (1.0 + lw * lw)
                    : sigma * sigma * time / kPi * (1.0 + 3.0 * lw * lw) / std::pow(1 + lw * lw, 2);
      const double got = density(x[axis], kStep, 4096, w);
      EXPECT_NEAR(got, formula, 0.15 * formula) << "at L w / V = " << share;
    }
  }
}

TEST(Wind, AutocovarianceIsThatOfTheSpectraAtAnyStep) {
  // R_u = e^-t/T, R_w = e^-t/T (1 - t / 2T); coarse and fine steps alike
  for (const double dt : {0.001, 0.05, 0.4}) {
    SCOPED_TRACE(dt);
    WindSettings settings;
    settings.turbulence = Turbulence::kCustom;
    settings.gust_sigma = {1, 1, 1};
    settings.gust_length = {10, 10, 10};
    const Wind wind(settings, 9);
    // many vehicles for a short time: ensemble means
    const auto lag = static_cast<std::uint64_t>(std::lround(0.8 / dt));
    double along = 0.0;
    double up = 0.0;
    constexpr std::uint32_t kVehicles = 6000;
    for (std::uint32_t v = 0; v < kVehicles; ++v) {
      GustState state;
      const Vector3d first = wind.over_step(state, v, 0, dt, {10, 0, 0}, 50);
      Vector3d last = first;
      for (std::uint64_t i = 1; i <= lag; ++i) {
        last = wind.over_step(state, v, i, dt, {10, 0, 0}, 50);
      }
      along += first.x() * last.x() / kVehicles;
      up += first.z() * last.z() / kVehicles;
      if (dt < 0.01 && v > 1500) {
        along *= static_cast<double>(kVehicles) / (v + 1);
        up *= static_cast<double>(kVehicles) / (v + 1);
        break;
      }
    }
    EXPECT_NEAR(along, std::exp(-0.8), 0.08);
    EXPECT_NEAR(up, std::exp(-0.8) * (1 - 0.4), 0.08);
  }
}

TEST(Wind, LowAltitudeFiguresAreThoseOfTheStandard) {
  // MIL-F-8785C at 10 m and W20 of 15 knots, worked out by hand
  const GustScales s = low_altitude_gusts(10.0, 15 * 1852.0 / 3600);
  EXPECT_NEAR(s.sigma.z(), 0.772, 0.001);
  EXPECT_NEAR(s.sigma.x(), 1.46, 0.01);
  EXPECT_NEAR(s.length.x(), 67.4, 0.2);
  EXPECT_NEAR(s.length.z(), 10.0, 1e-9);
  // below 10 feet as at 10 feet
  EXPECT_EQ(low_altitude_gusts(0.5, 7.7).length.z(), low_altitude_gusts(3.0, 7.7).length.z());
}

TEST(Wind, CalmIsCalmAndMeanIsTheMean) {
  EXPECT_TRUE(Wind(WindSettings{}, 1).is_calm());
  WindSettings settings;
  settings.mean = {3, -1, 0.5};
  GustState state;
  EXPECT_EQ(Wind(settings, 1).over_step(state, 0, 0, 1e-3, {0, 0, 0}, 10), settings.mean);
}

}  // namespace
}  // namespace pointflight
