#include "pointflight/sim/self_test.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "pointflight/core/hash.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/sim/simulation.hpp"

namespace pointflight {
namespace {

/// A hash of numbers, one after the other.
class RunningHash {
 public:
  template <class T>
  void add(const T& value) {
    hash_ = hash64(std::as_bytes(std::span(&value, 1))) ^ (1099511628211u * hash_);
  }
  void add(const Vector3d& v) {
    for (int i = 0; i < 3; ++i) add(v[i]);
  }
  [[nodiscard]] std::string text() const { return fmt::format("{:016x}", hash_); }

 private:
  std::uint64_t hash_ = 0;
};

/// Hashes what comes of a flight.
class FlightHashes : public SampleSink {
 public:
  void on_sample(const Sample& sample) override {
    if (const auto* state = std::get_if<StateSample>(&sample)) {
      states.add(state->time.time_since_epoch().count());
      states.add(state->state.body.p_world);
      states.add(state->state.body.v_world);
      states.add(state->state.body.omega_body);
      for (const RotorState& rotor : state->state.rotors) states.add(rotor.speed);
    } else if (const auto* imu_sample = std::get_if<ImuSample>(&sample)) {
      imu.add(imu_sample->gyro);
      imu.add(imu_sample->accel);
    } else if (const auto* scan = std::get_if<ScanSample>(&sample)) {
      for (const ScanPoint& p : scan->scan->points) {
        for (int i = 0; i < 3; ++i) scans.add(p.position_sensor[i]);
        scans.add(p.intensity);
        scans.add(p.time_offset.count());
        scans.add(p.ring);
      }
    }
  }

  RunningHash states, imu, scans;
};

Scenario self_test_scenario(const char* renderer) {
  Scenario scenario;
  scenario.duration = 1.0;
  scenario.unfinished = Unfinished::kTimeUp;
  scenario.seed = 7;
  VehicleSetup& vehicle = scenario.vehicles.front();
  vehicle.start = {10.0, 5.0, 1.5};
  vehicle.lidars.clear();
  for (const char* model : {"mid360", "vlp16"}) {
    LidarMount& mount = vehicle.lidars.emplace_back();
    mount.model = model;
    mount.renderer = std::string(renderer);
  }
  scenario.air.wind.mean = {2.0, 1.0, 0.0};
  scenario.air.wind.turbulence = Turbulence::kLight;
  return scenario;
}

}  // namespace

std::vector<SelfTestHash> self_test(const Executor& executor, const Progress& progress) {
  WorldMapOptions world;
  world.world.name = "warehouse";
  world.resolution = 0.2;
  report(progress, "making a world", 0.0);
  const auto map = open_world_map(world, executor);
  std::vector<SelfTestHash> hashes = {{"map", map->hash()}};
  for (const char* renderer : {"beam", "paper"}) {
    report(progress, fmt::format("flying with {}", renderer), hashes.size() < 2 ? 0.4 : 0.7);
    Simulation simulation(self_test_scenario(renderer), map, executor);
    FlightHashes flight;
    while (simulation.step(flight)) {
    }
    if (hashes.size() < 2) {
      hashes.push_back({"states", flight.states.text()});
      hashes.push_back({"imu", flight.imu.text()});
    }
    hashes.push_back({fmt::format("scans_{}", renderer), flight.scans.text()});
  }
  report(progress, "flying", 1.0);
  return hashes;
}

std::vector<SelfTestHash> released_hashes() {
  const MappedFile file((std::filesystem::path(data_folder()) / "self_test.csv").string());
  std::vector<SelfTestHash> hashes;
  LineCursor lines(file.text());
  std::string_view line;
  while (lines.next(line)) {
    if (line.empty() || line.front() == '#') continue;
    const std::string what(take_word(line));
    hashes.push_back({what, std::string(take_word(line))});
  }
  return hashes;
}

std::string self_test_file(const std::vector<SelfTestHash>& hashes) {
  std::string text =
      "# What `pointflight self-test` computes on every machine; renewed by `pointflight self-test "
      "--write`\n";
  for (const SelfTestHash& hash : hashes) text += fmt::format("{},{}\n", hash.what, hash.hash);
  return text;
}

}  // namespace pointflight
