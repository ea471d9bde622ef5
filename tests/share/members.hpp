// Processes of a shared run as tests have them: each with its simulation, on a bus in memory.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "pointflight/share/share_link.hpp"
#include "tests/share/bus.hpp"
#include "tests/sim/runs.hpp"
#include "tests/support.hpp"

namespace pointflight::testing {

/// What each vehicle says by itself.
class PerVehicle : public SampleSink {
 public:
  void on_sample(const Sample& sample) override {
    std::visit([&](const auto& s) { take(s, sample); }, sample);
  }
  std::map<std::size_t, ByteSink> sinks;
  std::vector<VehicleEvent> events;
  std::vector<CollisionEvent> collisions;

  [[nodiscard]] std::vector<std::string> kinds() const {
    std::vector<std::string> kinds;
    for (const VehicleEvent& event : events) kinds.push_back(event.kind);
    return kinds;
  }

 private:
  void take(const ScanSample& s, const Sample& sample) { sinks[s.scan->vehicle].on_sample(sample); }
  void take(const ObstacleSample& /*s*/, const Sample& /*sample*/) {}
  void take(const StatusSample& /*s*/, const Sample& /*sample*/) {}
  void take(const VehicleEvent& s, const Sample& /*sample*/) { events.push_back(s); }
  void take(const CollisionEvent& s, const Sample& sample) {
    collisions.push_back(s);
    sinks[s.vehicle].on_sample(sample);
  }
  template <class S>
  void take(const S& s, const Sample& sample) {
    sinks[s.vehicle].on_sample(sample);
  }
};

inline Scenario with_share(Scenario scenario, const ShareSetup& setup) {
  scenario.sections["share"] = setup;
  return scenario;
}

/// One process.
struct Member {
  Member(Bus& bus,
         const Scenario& scenario,
         std::vector<std::size_t> vehicles,
         std::function<std::int64_t()> steady,
         std::uint64_t id)
      : executor(1), simulation(scenario, hall(), executor), end(bus.join()), clock(steady) {
    FleetShareOptions options;
    options.run = "test";
    options.process = "host:" + std::to_string(id);
    options.id = id;
    options.vehicles = vehicles;
    options.steady = std::move(steady);
    options.clock = [this](std::int64_t at) { return due_at(at); };
    options.log = [this](const std::string& line) { lines.push_back(line); };
    options.interrupted = [this] { return interrupted; };
    share = std::make_unique<FleetShare>(simulation, *end, options);
    share->take_part(simulation);
    link = std::make_unique<ShareLink>(simulation, *share);
  }

  [[nodiscard]] std::optional<SimTime> due_at(std::int64_t at) const {
    if (start < 0) return std::nullopt;
    return from + Duration(at - start);
  }

  /// As the run's loop does it.
  void obey_share() {
    for (const Order& order : link->take_orders()) {
      if (const auto* skip = std::get_if<SkipOrder>(&order)) {
        simulation.skip_to(skip->to);
        from = skip->to;
        start = clock();
      } else if (const auto* hurry = std::get_if<ShiftPaceOrder>(&order)) {
        start -= hurry->by.count();
      }
    }
  }

  /// What is due by the clock.
  void tick() {
    if (start < 0) {
      if (!link->is_ready()) return;
      start = clock();
      from = simulation.time();
    }
    while (simulation.time() <= *due_at(clock()) && simulation.step(sink)) obey_share();
  }

  Executor executor;
  Simulation simulation;
  PerVehicle sink;
  std::unique_ptr<Bus::End> end;
  std::unique_ptr<FleetShare> share;
  std::unique_ptr<ShareLink> link;
  std::function<std::int64_t()> clock;
  std::vector<std::string> lines;
  std::int64_t start = -1;  ///< By the clock.
  SimTime from;
  bool interrupted = false;
};

/// Two that fly to and fro through each other, without LiDARs.
inline Scenario through_each_other() {
  Scenario s;
  s.path = "s.yaml";
  s.duration = 40.0;
  s.vehicles.resize(2);
  for (std::size_t i = 0; i < 2; ++i) {
    VehicleSetup& v = s.vehicles[i];
    v.name = i == 0 ? "a" : "b";
    v.lidars.clear();
    const double x = i == 0 ? 8.0 : 11.0;
    v.start = {x, 6, 3};
    for (int k = 0; k < 12; ++k) v.mission.waypoints.push_back({k % 2 == 0 ? 19.0 - x : x, 6, 3});
  }
  ShareSetup setup;
  setup.lease = 0.5;
  return with_share(s, setup);
}

/// By clocks: time that only moves when it is told to.
struct World {
  std::int64_t now = 1'000'000'000;
  Bus bus{[this] { return now; }};
  std::vector<std::unique_ptr<Member>> members;
  std::uint64_t last_id = 0;

  Member& add(const Scenario& scenario, std::vector<std::size_t> vehicles) {
    members.push_back(std::make_unique<Member>(
        bus, scenario, std::move(vehicles), [this] { return now; }, ++last_id));
    return *members.back();
  }
  /// All that are not in `still`.
  void pass(double seconds, const std::vector<Member*>& still = {}) {
    const std::int64_t until = now + std::llround(1e9 * seconds);
    for (; now < until; now += 1'000'000) {
      for (const auto& member : members) {
        if (std::find(still.begin(), still.end(), member.get()) == still.end()) member->tick();
      }
    }
  }
};

}  // namespace pointflight::testing
