#pragma once

#include <cstring>
#include <map>
#include <memory>
#include <vector>

#include "pointflight/core/hash.hpp"
#include "pointflight/sim/simulation.hpp"
#include "tests/support.hpp"

/// Small runs that tests of the simulation share.
namespace pointflight::testing {

/// Everything that a run delivers, as bytes.
class ByteSink : public SampleSink {
 public:
  void on_sample(const Sample& sample) override {
    std::visit([this](const auto& s) { take(s); }, sample);
  }

  [[nodiscard]] std::uint64_t hash() const { return hash64(bytes_); }
  std::map<Label, int> labels;
  std::vector<CollisionEvent> events;
  int scans = 0;

 private:
  void take(const VehicleEvent& /*event*/) {}
  void take(const Measurement& m) {
    for (const double value : m.values) add(value);
  }
  void take(const StateSample& s) {
    add(s.vehicle);
    add(s.time.time_since_epoch().count());
    add_body(s.state.body);
    for (const RotorState& rotor : s.state.rotors) add(rotor.speed);
    if (s.nearest) add(s.nearest->distance);
  }
  void take(const OdometrySample& s) {
    add(s.delivered.time_since_epoch().count());
    add_body(s.state);
  }
  void take(const ImuSample& s) {
    add(s.vehicle);
    for (int i = 0; i < 3; ++i) add(s.gyro[i] + 10.0 * s.accel[i]);
  }
  void take(const ScanSample& sample) {
    const Scan& scan = *sample.scan;
    add(scan.vehicle);
    add(scan.index);
    for (const ScanPoint& p : scan.points) {
      add(p.range);
      add(p.label);
      ++labels[p.label];
    }
    ++scans;
  }
  void take(const CollisionEvent& e) {
    add(e.partner);
    add(e.time.time_since_epoch().count());
    events.push_back(e);
  }
  void take(const ObstacleSample& o) {
    for (const PlacedObstacle& obstacle : o.obstacles) add(obstacle.T_world_body.translation.x());
  }
  void take(const StatusSample& /*s*/) {}

  template <class T>
  void add(T value) {
    const auto* raw = reinterpret_cast<const std::byte*>(&value);
    bytes_.insert(bytes_.end(), raw, raw + sizeof value);
  }
  void add_body(const RigidBodyState& b) {
    for (int i = 0; i < 3; ++i) {
      add(b.p_world[i]);
      add(b.v_world[i]);
      add(b.omega_body[i]);
    }
    add(b.q_world_body.w());
  }
  std::vector<std::byte> bytes_;
};

inline std::shared_ptr<const SurfelMap> hall() {
  static const auto map = [] {
    ShapeScene scene;
    scene.add_box({0, 0, 0}, {40, 24, 6});
    for (int i = 0; i < 6; ++i) {
      scene.shapes.emplace_back(Cone{{5.0 + 6 * i, 12, 0}, {5.0 + 6 * i, 12, 6}, 0.3, 0.3});
    }
    return map_of(scene, 0.2, 10.0, 0.005);
  }();
  return map;
}

/// One vehicle hovering in the hall, without a LiDAR.
inline Scenario hovering() {
  Scenario s;
  s.path = "s.yaml";
  s.duration = 3.0;
  s.vehicles[0].start = {10, 6, 3};
  s.vehicles[0].lidars.clear();
  return s;
}

/// Runs to the end.
inline Simulation run(const Scenario& scenario, SampleSink& sink, const Executor& executor) {
  Simulation simulation(scenario, hall(), executor);
  while (simulation.step(sink)) {
  }
  return simulation;
}

/// A ball that passes through (10, 6, 3) along y from 3 m away.
inline ObstacleSettings passing(double speed) {
  ObstacleSettings o;
  o.size.radius = 0.3;
  o.motion = ObstacleMotion::kLoop;
  o.speed = speed;
  o.waypoints = {{10, 3, 3}, {10, 9, 3}};
  return o;
}

}  // namespace pointflight::testing
