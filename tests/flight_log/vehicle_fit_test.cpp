#include "pointflight/flight_log/vehicle_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "pointflight/core/input_error.hpp"
#include "pointflight/flight_log/log_comparison.hpp"
#include "tests/flight_log/flown_log.hpp"
#include "tests/flight_log/log_bytes.hpp"

namespace pointflight {
namespace {

/// A file that is wrong about all that is fitted.
VehicleSettings wrong(const VehicleSettings& truth) {
  VehicleSettings like = truth;
  like.rotor.thrust_coefficient *= 0.9;
  like.rotor.torque_coefficient *= 0.9;
  like.rotor.speed_min *= 0.7;
  like.rotor.natural_frequency *= 1.3;
  like.rotor.drag_coefficient *= 0.5;
  like.drag_area *= 1.5;
  like.inertia_diagonal = like.inertia_diagonal.cwiseProduct(Vector3d(1.3, 0.75, 1.25));
  return like;
}

/// The figures of a file, in the order of a fit's.
std::array<double, 9> figures_of(const VehicleSettings& v) {
  return {v.rotor.thrust_coefficient,
          v.rotor.speed_min,
          v.rotor.natural_frequency,
          v.rotor.drag_coefficient,
          v.drag_area.x(),
          v.drag_area.z(),
          v.inertia_diagonal.x(),
          v.inertia_diagonal.y(),
          v.inertia_diagonal.z()};
}

/// Thrust by mass at the output that hovers and at the greatest one.
std::array<double, 2> thrust_of(const VehicleSettings& v, double hover_output) {
  const auto at = [&](double u) {
    const double w = v.rotor.speed_min + u * (v.rotor.speed_max - v.rotor.speed_min);
    return static_cast<double>(v.rotors.size()) * v.rotor.thrust_coefficient * w * w / v.mass;
  };
  return {at(hover_output), at(1.0)};
}

TEST(VehicleFit, FindsWhatAnIdealLogTells) {
  const VehicleSettings truth = load_vehicle("quad_330");
  FlownLogOptions options;
  options.is_noisy = false;
  const VehicleFit fit = fit_vehicle(flown_log(truth, options), wrong(truth), Executor(2));
  const auto expected = figures_of(truth);
  ASSERT_EQ(fit.figures.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_TRUE(fit.figures[i].is_told) << fit.figures[i].key;
    EXPECT_NEAR(fit.figures[i].value / expected[i], 1.0, 2e-3) << fit.figures[i].key;
    EXPECT_EQ(fit.figures[i].value, figures_of(fit.vehicle)[i]);
  }
  EXPECT_LT(fit.after.accel.norm(), 1e-3);
  EXPECT_GT(fit.before.accel.norm(), 1.0);
}

TEST(VehicleFit, FindsThemInNoiseAndThroughAFile) {
  for (const char* name : {"quad_330", "x500"}) {
    const VehicleSettings truth = load_vehicle(name);
    FlownLogOptions options;
    options.duration = 60.0;
    const FlightLog log = parsed(ulog_of(flown_log(truth, options)));
    const VehicleFit fit = fit_vehicle(log, wrong(truth), Executor(2));
    const auto expected = figures_of(truth);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const FittedFigure& figure = fit.figures[i];
      if (!figure.is_told) continue;
      const double room = std::max(0.1, 3.0 * figure.sigma / expected[i]);
      EXPECT_NEAR(figure.value / expected[i], 1.0, room) << name << ": " << figure.key;
      EXPECT_LT(std::abs(figure.value - expected[i]), 4.0 * figure.sigma)
          << name << ": " << figure.key;
    }
    const auto thrust = thrust_of(fit.vehicle, 0.5);
    EXPECT_NEAR(thrust[0] / thrust_of(truth, 0.5)[0], 1.0, 0.03) << name;
    EXPECT_NEAR(thrust[1] / thrust_of(truth, 0.5)[1], 1.0, 0.03) << name;
  }
}

TEST(VehicleFit, SaysWhatAHoverDoesNotTell) {
  const VehicleSettings truth = load_vehicle("x500");
  FlownLogOptions options;
  options.hovers = true;
  const VehicleFit fit = fit_vehicle(flown_log(truth, options), wrong(truth), Executor(2));
  for (const FittedFigure& figure : fit.figures) {
    if (figure.key.find("drag") == std::string::npos) continue;
    EXPECT_FALSE(figure.is_told) << figure.key;
    EXPECT_EQ(figure.value, figure.before);
    EXPECT_FALSE(figure.remark.empty());
  }
  EXPECT_TRUE(fit.figures[0].is_told);
  // it hovers at the same output, whatever is not told
  const double hover = std::sqrt(truth.mass * 9.80665 / (4.0 * truth.rotor.thrust_coefficient));
  const double u =
      (hover - truth.rotor.speed_min) / (truth.rotor.speed_max - truth.rotor.speed_min);
  EXPECT_NEAR(thrust_of(fit.vehicle, u)[0], 9.80665, 0.2);
}

TEST(VehicleFit, SlowLogsTellNoLagAndNoInertia) {
  const VehicleSettings truth = load_vehicle("x500");
  FlownLogOptions options;
  FlightLog log = flown_log(truth, options);
  std::vector<LoggedOutputs> some;
  for (std::size_t i = 0; i < log.outputs.size(); i += 25) some.push_back(log.outputs[i]);
  log.outputs = some;  // at 10 Hz
  const VehicleFit fit = fit_vehicle(log, wrong(truth), Executor(2));
  for (const FittedFigure& figure : fit.figures) {
    if (figure.key != "rotor.natural_frequency" && !figure.key.starts_with("inertia")) continue;
    EXPECT_FALSE(figure.is_told);
    EXPECT_NE(figure.remark.find("at 10 Hz"), std::string::npos) << figure.remark;
  }
  EXPECT_TRUE(fit.figures[0].is_told);
}

TEST(VehicleFit, RefusesShortFlightsAndOtherVehicles) {
  const VehicleSettings x500 = load_vehicle("x500");
  FlownLogOptions options;
  options.duration = 5.0;
  const FlightLog log = flown_log(x500, options);
  EXPECT_THROW(fit_vehicle(log, x500, Executor(1)), InputError);
  options.duration = 12.0;
  EXPECT_THROW(fit_vehicle(flown_log(x500, options), load_vehicle("hexa_550"), Executor(1)),
               InputError);
  FlightLog grounded = flown_log(x500, options);
  for (LoggedOutputs& outputs : grounded.outputs) outputs.outputs.assign(4, std::nanf(""));
  EXPECT_THROW(fit_vehicle(grounded, x500, Executor(1)), InputError);
}

TEST(VehicleFit, IsTheSameOnAnyNumberOfThreads) {
  const VehicleSettings truth = load_vehicle("x500");
  FlownLogOptions options;
  options.duration = 15.0;
  const FlightLog log = flown_log(truth, options);
  const VehicleFit one = fit_vehicle(log, wrong(truth), Executor(1));
  const VehicleFit two = fit_vehicle(log, wrong(truth), Executor(2));
  for (std::size_t i = 0; i < one.figures.size(); ++i) {
    EXPECT_EQ(one.figures[i].value, two.figures[i].value);
    EXPECT_EQ(one.figures[i].sigma, two.figures[i].sigma);
  }
}

TEST(VehicleFit, Statistics_DeviationsHold) {
  // 95 of 100 within 1.96 deviations; each figure by itself, over flights of other seeds
  const VehicleSettings truth = load_vehicle("quad_330");
  const VehicleSettings like = wrong(truth);
  const auto expected = figures_of(truth);
  const int seeds = std::getenv("POINTFLIGHT_THOROUGH") != nullptr ? 200 : 20;
  std::array<int, 9> within{};
  std::array<int, 9> told{};
  for (int seed = 1; seed <= seeds; ++seed) {
    FlownLogOptions options;
    options.seed = static_cast<std::uint64_t>(seed);
    const VehicleFit fit = fit_vehicle(flown_log(truth, options), like, Executor(2));
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const FittedFigure& figure = fit.figures[i];
      if (!figure.is_told) continue;
      ++told[i];
      within[i] += std::abs(figure.value - expected[i]) <= 1.96 * figure.sigma ? 1 : 0;
    }
  }
  for (std::size_t i = 0; i < expected.size(); ++i) {
    // three deviations of the count below 95 %
    const double n = told[i];
    EXPECT_GE(within[i], 0.95 * n - 3.0 * std::sqrt(0.95 * 0.05 * n)) << i << " of " << n;
    ::testing::Test::RecordProperty("figure_" + std::to_string(i),
                                    std::to_string(within[i]) + " of " + std::to_string(told[i]));
  }
}

TEST(LogComparison, ATrueFileFliesAsTheLogHasIt) {
  const VehicleSettings truth = load_vehicle("x500");
  FlownLogOptions options;
  options.duration = 20.0;
  options.is_noisy = false;
  const FlightLog log = flown_log(truth, options);
  const LogComparison good = fly_outputs(log, truth);
  EXPECT_LT(good.gyro_rms.norm(), 1e-6);
  EXPECT_LT(good.accel_rms.norm(), 1e-6);
  EXPECT_LT(good.turn_rms, 1e-6);
  EXPECT_LT(good.speed_rms, 1e-6);
  EXPECT_NEAR(static_cast<double>(good.windows), 39.0, 2.0);  // from a quarter of a second on
  const LogComparison bad = fly_outputs(log, wrong(truth));
  EXPECT_GT(bad.gyro_rms.norm(), 0.05);
  EXPECT_GT(bad.accel_rms.norm(), 0.5);
  EXPECT_GT(bad.turn_rms, 1e-3);
}

}  // namespace
}  // namespace pointflight
