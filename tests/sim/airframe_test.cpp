// What LiDARs see of vehicles: their arms, motors and propellers, their own among them.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "pointflight/vehicle/vehicle_shape.hpp"
#include "tests/sim/runs.hpp"

namespace pointflight {
namespace {

using testing::hall;
using testing::hovering;

/// Keeps the scans.
class ScanSink : public SampleSink {
 public:
  std::vector<ScanSample> scans;
  void on_sample(const Sample& sample) override {
    if (const auto* scan = std::get_if<ScanSample>(&sample)) scans.push_back(*scan);
  }
};

/// Scans of a run, and its vehicles where they are at the end: at rest, to a millimetre.
struct Flown {
  ScanSink sink;
  std::vector<Pose> T_world_body;
  std::vector<Assembly> assemblies;
  std::vector<Solid> hulls;
};

Flown fly(const Scenario& scenario) {
  Flown flown;
  const Executor executor(2);
  Simulation simulation(scenario, hall(), executor);
  while (simulation.step(flown.sink)) {
  }
  for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
    flown.T_world_body.push_back(simulation.status(v).state.body.T_world_body());
    flown.assemblies.push_back(assembly_of(simulation.vehicle(v).settings()));
    flown.hulls.push_back(simulation.vehicle(v).hull());
  }
  return flown;
}

Scenario two_that_hover(double apart) {
  Scenario scenario = hovering();
  scenario.duration = 0.5;
  scenario.vehicles[0].lidars = {LidarMount{}};
  scenario.vehicles.push_back(scenario.vehicles[0]);
  scenario.vehicles[0].name = "a";
  scenario.vehicles[1].name = "b";
  scenario.vehicles[1].model = "hexa_550";
  scenario.vehicles[1].start += Vector3d(apart, 0, 0.3);
  scenario.vehicles[1].lidars.clear();
  scenario.vehicles[0].lidars[0].model = "os0_128";
  scenario.vehicles[0].lidars[0].noise = false;
  scenario.vehicles[0].lidars[0].sub_rays = 1;
  return scenario;
}

TEST(Airframe, OthersAreSeenAsTheyAreBuiltAndWhereTheirBladesStand) {
  const Flown flown = fly(two_that_hover(1.5));
  const Pose T_body_world = flown.T_world_body[1].inverse();
  std::size_t seen = 0;
  std::size_t blades = 0;
  for (const ScanSample& sample : flown.sink.scans) {
    for (const ScanPoint& point : sample.scan->points) {
      if (point.label != kFirstVehicle + 1) continue;
      ++seen;
      const SimTime time = sample.scan->seen_at(point);
      const Pose T_body_sensor = T_body_world * sample.T_world_sensor.at(time);
      const Vector3d place = T_body_sensor * point.position_sensor.cast<double>();
      double nearest = 1.0;
      for (const AssemblyPart& part : flown.assemblies[1].parts) {
        const Vector3d p = part.T_assembly_part.inverse() * place;
        nearest = std::min(nearest, std::abs(signed_distance(part.solid, p)));
      }
      if (nearest < 2e-3) continue;
      ++blades;
      for (const Propeller& propeller : flown.assemblies[1].propellers) {
        const Vector3d out = place - propeller.center;
        if (std::abs(out.z()) > 0.01 || out.head<2>().norm() > propeller.radius + 0.01) continue;
        // one of two blades points there at that time
        const double angle = propeller.phase + propeller.speed * to_seconds(time);
        const double across = -std::sin(angle) * out.x() + std::cos(angle) * out.y();
        EXPECT_LT(std::abs(across), 0.5 * propeller.chord + 2e-3);
        nearest = 0.0;
      }
      EXPECT_EQ(nearest, 0.0) << place.transpose() << ": nothing is there";
    }
  }
  EXPECT_GT(seen, 800u);
  EXPECT_GT(blades, 50u);
}

TEST(Airframe, ByItsFileTheHullIsSeen) {
  const testing::TemporaryFolder folder;
  Scenario scenario = two_that_hover(2.0);
  scenario.vehicles[1].model = testing::changed_vehicle(
      folder, "hexa_550", "mass:", "airframe: {seen_as_hull: true}\nmass:");
  const Flown flown = fly(scenario);
  const Pose T_body_world = flown.T_world_body[1].inverse();
  std::size_t seen = 0;
  for (const ScanSample& sample : flown.sink.scans) {
    for (const ScanPoint& point : sample.scan->points) {
      if (point.label != kFirstVehicle + 1) continue;
      ++seen;
      const Vector3d p = T_body_world * sample.T_world_sensor.at(sample.scan->seen_at(point)) *
                         point.position_sensor.cast<double>();
      EXPECT_NEAR(signed_distance(flown.hulls[1], p), 0.0, 2e-3);
    }
  }
  EXPECT_GT(seen, 4000u);
}

TEST(Airframe, AQt64OnTopSeesItsOwnArmsWhereItIsToldTo) {
  Scenario scenario = hovering();
  scenario.duration = 0.35;
  scenario.vehicles[0].lidars = {LidarMount{}};
  scenario.vehicles[0].lidars[0].model = "qt64";  // down to -52 degrees, from 0.1 m on
  scenario.vehicles[0].lidars[0].noise = false;
  scenario.vehicles[0].lidars[0].sub_rays = 1;
  const Flown without = fly(scenario);
  scenario.vehicles[0].lidars[0].own_airframe = true;
  const Flown with = fly(scenario);
  ASSERT_EQ(with.sink.scans.size(), without.sink.scans.size());
  std::size_t own = 0;
  for (const ScanSample& sample : with.sink.scans) {
    for (const ScanPoint& point : sample.scan->points) {
      if (point.label != kFirstVehicle) {
        EXPECT_GT(point.range, 0.5f);
        continue;
      }
      ++own;
      EXPECT_GE(point.range, 0.1f);
      EXPECT_LT(point.range, 0.4f);
      EXPECT_LT(point.position_sensor.z(), 0.0f);
    }
  }
  EXPECT_GT(own, 500u);
  for (const ScanSample& sample : without.sink.scans) {
    for (const ScanPoint& point : sample.scan->points) EXPECT_EQ(point.label, kMapLabel);
  }
  // what it hides, and what lies too near for the sensor, does not come back
  EXPECT_LT(with.sink.scans[0].scan->points.size(), without.sink.scans[0].scan->points.size());
}

}  // namespace
}  // namespace pointflight
