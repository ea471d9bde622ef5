// Barometer, magnetometer, satellites, range finder: against closed forms and their own figures.
#include "pointflight/sim/navigation_sensors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "pointflight/core/constants.hpp"
#include "tests/sim/runs.hpp"

namespace pointflight {
namespace {

using namespace testing;

class MeasurementSink : public ByteSink {
 public:
  void on_sample(const Sample& sample) override {
    if (const auto* m = std::get_if<Measurement>(&sample)) all[m->sensor].push_back(*m);
    ByteSink::on_sample(sample);
  }
  std::map<std::uint32_t, std::vector<Measurement>> all;
};

/// What one sensor of a kind measures on a hovering vehicle.
template <class Settings>
std::vector<Measurement> measured(const char* kind,
                                  const Settings& settings,
                                  double duration = 20.0,
                                  std::int64_t seed = 1,
                                  const EarthOrigin& origin = {}) {
  Scenario scenario = hovering();
  scenario.origin = origin;
  scenario.seed = seed;
  scenario.duration = duration;
  scenario.vehicles[0].sensors = {{sensor_kinds().find(kind), settings}};
  MeasurementSink sink;
  const Executor executor(1);
  run(scenario, sink, executor);
  EXPECT_EQ(sink.all.size(), 1u);
  return sink.all.begin()->second;
}

double mean_of(const std::vector<Measurement>& all, std::size_t value) {
  double sum = 0.0;
  for (const Measurement& m : all) sum += m.values[value];
  return sum / static_cast<double>(all.size());
}

double deviation_of(const std::vector<Measurement>& all, std::size_t value) {
  const double mean = mean_of(all, value);
  double sum = 0.0;
  for (const Measurement& m : all) sum += (m.values[value] - mean) * (m.values[value] - mean);
  return std::sqrt(sum / static_cast<double>(all.size()));
}

TEST(NavigationSensors, TheStandardAtmosphereIsThatOfItsTables) {
  // ISO 2533: geopotential altitudes
  EXPECT_NEAR(standard_pressure(0.0, 101325.0), 101325.0, 1e-6);
  EXPECT_NEAR(standard_pressure(1000.0, 101325.0), 89874.6, 5.0);
  EXPECT_NEAR(standard_pressure(5000.0, 101325.0), 54020.0, 10.0);
}

TEST(NavigationSensors, ABarometerHasItsNoiseAndOffset) {
  BarometerSettings s;
  s.drift = 0.0;
  const auto all = measured("barometer", s);
  EXPECT_NEAR(static_cast<double>(all.size()), 1000.0, 2.0);
  EXPECT_NEAR(deviation_of(all, 0), s.noise, 0.1 * s.noise);
  double squares = 0.0;
  constexpr int kRuns = 40;
  for (int i = 0; i < kRuns; ++i) {
    const double off =
        mean_of(measured("barometer", s, 0.5, i), 0) - standard_pressure(3.0, s.sea_pressure);
    squares += off * off / kRuns;
  }
  EXPECT_NEAR(std::sqrt(squares), s.offset, 0.35 * s.offset);
}

TEST(NavigationSensors, AMagnetometerSeesTheFieldOfItsPlace) {
  MagnetometerSettings s;
  s.hard_iron = 0.0;
  s.scale_error = 0.0;
  const auto all = measured("magnetometer", s);
  const double level = s.field * std::cos(s.inclination_deg * kDegree);
  // it looks along world x: east
  EXPECT_NEAR(mean_of(all, 0), level * std::sin(s.declination_deg * kDegree), 0.05);
  EXPECT_NEAR(mean_of(all, 1), level * std::cos(s.declination_deg * kDegree), 0.05);
  EXPECT_NEAR(mean_of(all, 2), -s.field * std::sin(s.inclination_deg * kDegree), 0.05);
  EXPECT_NEAR(deviation_of(all, 1), s.noise, 0.1 * s.noise);
}

/// Earth-centred coordinates by the closed form (WGS 84).
Vector3d earth_centred(const GeodeticPosition& g) {
  const double e2 = (2.0 - 1.0 / 298.257223563) / 298.257223563;
  const double b = g.latitude * kDegree;
  const double l = g.longitude * kDegree;
  const double n = 6378137.0 / std::sqrt(1.0 - e2 * std::sin(b) * std::sin(b));
  return {(n + g.altitude) * std::cos(b) * std::cos(l),
          (n + g.altitude) * std::cos(b) * std::sin(l),
          (n * (1.0 - e2) + g.altitude) * std::sin(b)};
}

TEST(NavigationSensors, PlacesLieOnTheEllipsoid) {
  const GeodeticPosition origin{48.2, 11.6, 520.0};
  const double b = origin.latitude * kDegree;
  const double l = origin.longitude * kDegree;
  const Vector3d east(-std::sin(l), std::cos(l), 0.0);
  const Vector3d north(-std::sin(b) * std::cos(l), -std::sin(b) * std::sin(l), std::cos(b));
  for (const Vector3d& p : {Vector3d(0, 0, 0), Vector3d(100, -50, 20), Vector3d(-300, 250, -10)}) {
    const Vector3d way = earth_centred(geodetic(origin, p)) - earth_centred(origin);
    EXPECT_NEAR(way.dot(east), p.x(), 0.02);
    EXPECT_NEAR(way.dot(north), p.y(), 0.02);
    EXPECT_NEAR(way.dot(east.cross(north)), p.z(), 0.02);  // the earth falls 1 cm in 350 m
  }
}

TEST(NavigationSensors, FixesErrSlowlyAreLateAndStopInOutages) {
  GnssSettings s;
  s.outages = {{5.0, 8.0}};
  const auto all = measured("gnss", s);
  EXPECT_NEAR(static_cast<double>(all.size()), 170.0, 2.0);
  for (const Measurement& m : all) {
    const double t = to_seconds(m.time.time_since_epoch());
    EXPECT_FALSE(t >= 5.0 && t < 8.0);
    EXPECT_EQ(m.delivered - m.time, from_seconds(s.latency));
  }
  EXPECT_NEAR(deviation_of(all, 5), s.velocity_noise, 0.2 * s.velocity_noise);
  double squares = 0.0;
  constexpr int kRuns = 60;
  const GeodeticPosition truth =
      geodetic({EarthOrigin{}.latitude, EarthOrigin{}.longitude, 0.0}, {10, 6, 3});
  for (int i = 0; i < kRuns; ++i) {
    const auto fix = measured("gnss", s, 0.3, i).front();
    const double north = (fix.values[0] - truth.latitude) * kDegree * 6.37e6;
    squares += north * north / kRuns;
  }
  EXPECT_NEAR(std::sqrt(squares), std::hypot(s.horizontal, s.noise), 0.3 * s.horizontal);
}

TEST(NavigationSensors, ARangeFinderSeesTheFloorAndNothingBeyondItsReach) {
  RangeFinderSettings s;
  const auto all = measured("range_finder", s);
  EXPECT_NEAR(mean_of(all, 0), 3.0, 0.02);
  EXPECT_NEAR(deviation_of(all, 0), s.noise, 0.1 * s.noise);
  s.range_max = 2.0;
  for (const Measurement& m : measured("range_finder", s, 1.0)) EXPECT_EQ(m.values[0], -1.0);
}

TEST(NavigationSensors, BarometerAndGnssKnowOneOrigin) {
  const EarthOrigin origin{47.4, 8.5, 408.0, 47.0};
  BarometerSettings barometer;
  barometer.noise = barometer.offset = barometer.drift = 0.0;
  const Measurement pressure = measured("barometer", barometer, 0.5, 1, origin).front();
  EXPECT_NEAR(pressure.values[0], standard_pressure(411.0, barometer.sea_pressure), 0.1);
  GnssSettings gnss;
  gnss.horizontal = gnss.vertical = gnss.noise = 0.0;
  const Measurement fix = measured("gnss", gnss, 0.5, 1, origin).front();
  EXPECT_NEAR(fix.values[2], 458.0, 0.01);  // of the ellipsoid
  EXPECT_NEAR(fix.values[0], 47.4, 1e-3);
  EXPECT_NEAR(fix.values[1], 8.5, 1e-3);
  const Scenario read = parse_scenario(
      "map: m.pfmap\norigin: {latitude: 47.4, altitude: 408, geoid_height: 47}\n", "s.yaml");
  EXPECT_EQ(read.origin.altitude, 408.0);
  EXPECT_EQ(read.origin.geoid_height, 47.0);
}

TEST(NavigationSensors, ScenariosNameThemWithTheirKeys) {
  const Scenario scenario = parse_scenario(
      "map: m.pfmap\nsensors:\n  - {kind: gnss, rate: 5, outages: [{from: 10, until: 20}]}\n"
      "  - {kind: range_finder, range_max: 40}\n",
      "s.yaml");
  ASSERT_EQ(scenario.vehicles[0].sensors.size(), 2u);
  EXPECT_EQ(std::any_cast<GnssSettings>(scenario.vehicles[0].sensors[0].settings).rate, 5.0);
  expect_contains(error_of([] {
                    parse_scenario("map: m.pfmap\nsensors:\n  - {kind: gnss, rat: 5}\n", "s.yaml");
                  }),
                  "s.yaml:3");
}

TEST(NavigationSensors, WhatMakesNoSenseTogetherIsSaidWithItsLine) {
  const auto error = [](const std::string& sensor) {
    return error_of([&] {
      static_cast<void>(parse_scenario("map: m.pfmap\nsensors:\n  - " + sensor + "\n", "s.yaml"));
    });
  };
  expect_contains(error("{kind: gnss, outages: [{from: 20, until: 10}]}"),
                  "s.yaml:3: sensors[0].outages[0].until: is not after from");
  expect_contains(error("{kind: range_finder, range_min: 5, range_max: 4}"),
                  "s.yaml:3: sensors[0].range_max: is not above range_min");
}

}  // namespace
}  // namespace pointflight
