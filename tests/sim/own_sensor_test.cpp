// Kinds of sensors, controllers and renderers that a program adds.
#include <gtest/gtest.h>

#include "pointflight/core/random.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "pointflight/sim/flight_recorder.hpp"
#include "pointflight/vehicle/controllers/cascaded_pid.hpp"
#include "tests/sim/runs.hpp"

namespace pointflight {
namespace {

using testing::ByteSink;
using testing::error_of;
using testing::expect_contains;
using testing::hall;
using testing::hovering;
using testing::read_file;
using testing::TemporaryFolder;

struct AltimeterSettings {
  double rate = 50.0;
  double walk = 0.0;
  double delay = 0.0;
};

void describe(SettingsVisitor& v, AltimeterSettings& s) {
  v.value({"rate", "Hz", "measurements a second", 0.1, 1000}, s.rate);
  v.value({"walk", "m", "deviation of each step of its drift", 0, 10}, s.walk);
  v.value({"delay", "s", "until a measurement arrives", 0, 1}, s.delay);
}

/// Height with a drift that it remembers.
class Altimeter : public InstantSensor {
 public:
  Altimeter(const SensorSite& site, const AltimeterSettings& settings)
      : InstantSensor(settings.rate),
        site_(site),
        settings_(settings),
        random_(site.seed, StreamId::kTest, site.vehicle << 8 | site.sensor) {}
  [[nodiscard]] std::any memory_at_start() const override { return 0.0; }
  [[nodiscard]] Sample measure(const InstantInput& input, std::any& memory) const override {
    auto& drift = *std::any_cast<double>(&memory);
    drift += settings_.walk * random_.normal(static_cast<std::uint64_t>(input.index));
    return Measurement{site_.vehicle,
                       site_.sensor,
                       input.time,
                       input.time + from_seconds(settings_.delay),
                       {input.state.body.p_world.z() + drift, drift}};
  }

 private:
  SensorSite site_;
  AltimeterSettings settings_;
  RandomStream random_;
};

/// Registers once for all tests of the process.
void add_altimeter() {
  if (sensor_kinds().find("altimeter") != nullptr) return;
  sensor_kinds().add(sensor_kind<Altimeter, AltimeterSettings>(
      "altimeter", "height above zero", {{"height", "m"}, {"drift", "m"}}));
}

Scenario with_altimeters() {
  add_altimeter();
  Scenario scenario = parse_scenario(
      "map: hall.pfmap\nduration: 0.5\nvehicle: {start: [10, 6, 3]}\nlidars: []\n"
      "sensors:\n  - {kind: altimeter, rate: 100}\n"
      "  - {kind: altimeter, rate: 50, walk: 0.1, delay: 0.1}\n",
      "own.yaml");
  return scenario;
}

TEST(OwnSensors, AreMountedByNameAndMeasureOnTheirSchedule) {
  const Scenario scenario = with_altimeters();
  ASSERT_EQ(scenario.vehicles[0].sensors.size(), 2u);
  const Executor executor(1);
  Simulation simulation(scenario, hall(), executor);
  std::map<std::uint32_t, std::vector<Measurement>> measured;
  SimTime last;
  SampleFunction sink([&](const Sample& sample) {
    if (const auto* m = std::get_if<Measurement>(&sample)) {
      EXPECT_GE(m->delivered, last);
      last = m->delivered;
      measured[m->sensor].push_back(*m);
    }
  });
  while (simulation.step(sink)) {
  }
  ASSERT_EQ(measured.size(), 2u);
  const auto& [exact, walked] =
      std::pair(measured.begin()->second, std::next(measured.begin())->second);
  EXPECT_EQ(exact.size(), 51u);   // 0 to 0.5 s
  EXPECT_EQ(walked.size(), 21u);  // what was measured after 0.4 s has not arrived
  EXPECT_NEAR(exact.back().values[0], 3.0, 0.01);
  EXPECT_EQ(walked[20].time, SimTime(std::chrono::milliseconds(400)));
  EXPECT_EQ(walked[20].delivered, SimTime(std::chrono::milliseconds(500)));
  EXPECT_NE(walked[20].values[1], walked[0].values[1]);
}

TEST(OwnSensors, RememberAndAreSavedWithTheRun) {
  const Executor executor(2);
  Simulation simulation(with_altimeters(), hall(), executor);
  ByteSink ignored;
  simulation.advance_to(SimTime(std::chrono::milliseconds(200)), ignored);
  const SimulationState saved = simulation.state();
  Simulation branch = simulation;
  ByteSink first;
  ByteSink again;
  ByteSink branched;
  while (simulation.step(first)) {
  }
  simulation.restore(saved);
  while (simulation.step(again)) {
  }
  while (branch.step(branched)) {
  }
  EXPECT_EQ(first.hash(), again.hash());
  EXPECT_EQ(first.hash(), branched.hash());
}

TEST(OwnSensors, HaveAFileOfTheirColumnsAndReadBack) {
  const TemporaryFolder folder;
  const Executor executor(1);
  Scenario scenario = with_altimeters();
  Simulation simulation(scenario, hall(), executor);
  FlightRecorder recorder(folder / "run", simulation);
  while (simulation.step(recorder)) {
  }
  recorder.finish(simulation);
  const std::string text = read_file(folder / "run/altimeter.csv");
  EXPECT_EQ(text.rfind("time,delivered,height,drift\n0.000000000,0.000000000,3,0\n", 0), 0u)
      << text;
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 52);
  const std::string late = read_file(folder / "run/altimeter_1.csv");
  EXPECT_EQ(std::count(late.begin(), late.end(), '\n'), 22);
  const Scenario read = load_scenario(folder / "run/scenario.yaml");
  ASSERT_EQ(read.vehicles[0].sensors.size(), 2u);
  EXPECT_EQ(std::any_cast<AltimeterSettings>(read.vehicles[0].sensors[1].settings).walk, 0.1);
}

TEST(OwnSensors, AreMountedByProgramsToo) {
  add_altimeter();
  const Executor executor(1);
  Scenario scenario = hovering();
  scenario.vehicles[0].sensors.push_back({sensor_kinds().find("altimeter"), {}});
  const Simulation simulation(scenario, hall(), executor);
  EXPECT_EQ(simulation.vehicle(0).sensors().size(), 3u);
  scenario.vehicles[0].sensors.push_back({nullptr, {}});
  expect_contains(error_of([&] { Simulation(scenario, hall(), executor); }),
                  "sensors[1].kind: '' is unknown");
}

TEST(OwnSensors, MistakesSayWhere) {
  add_altimeter();
  const auto error = [](const std::string& sensors) {
    return error_of([&] {
      static_cast<void>(parse_scenario("map: m.pfmap\nsensors: " + sensors + "\n", "s.yaml"));
    });
  };
  expect_contains(error("[{kind: sextant}]"), "s.yaml:2");
  expect_contains(error("[{kind: sextant}]"), "'sextant' is unknown; one of: barometer");
  expect_contains(error("[{kind: altimeter, colour: 1}]"), "colour");
  expect_contains(error("[{kind: altimeter, rate: -1}]"), "rate");
  const auto again = sensor_kind<Altimeter, AltimeterSettings>("altimeter", "", {});
  EXPECT_THROW(sensor_kinds().add(again), std::invalid_argument);
}

TEST(OwnTables, TakeControllersAndRenderers) {
  if (ControllerKind::table().find("copied") == nullptr) {
    ControllerKind::table().add(
        {.name = "copied",
         .help = "the cascade by another name",
         .make = [](const VehicleSettings& s) { return std::make_unique<CascadedPid>(s); },
         .integrates_attitude = true,
         .tilt_max_deg = 85.0});
    RendererKind::table().add(
        {.name = "copied",
         .help = "beam by another name",
         .make = [](const Scene& scene) { return std::make_unique<BeamRenderer>(scene); },
         .one_pose = false});
  }
  const Executor executor(2);
  Scenario scenario = hovering();
  scenario.map = "hall.pfmap";
  scenario.duration = 0.5;
  scenario.vehicles[0].lidars = {LidarMount{}};
  ByteSink shipped;
  testing::run(scenario, shipped, executor);
  scenario.vehicles[0].controller = "copied";
  scenario.vehicles[0].lidars[0].renderer = "copied";
  const Scenario read = parse_scenario(scenario_yaml(scenario), "s.yaml");
  EXPECT_EQ((*read.vehicles[0].controller)->name, "copied");
  ByteSink own;
  testing::run(scenario, own, executor);
  EXPECT_EQ(own.hash(), shipped.hash());
  expect_contains(error_of([] { static_cast<void>(Choice<RendererKind>("oil")); }),
                  "renderer 'oil' is unknown; one of: beam, paper");
}

}  // namespace
}  // namespace pointflight
