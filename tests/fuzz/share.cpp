// Messages of strangers, and of one who belongs to the run but has lost its mind, to a process of a
// shared run: it flies on, what it takes others for is finite, its lines are lines.
#include <cstdint>
#include <memory>
#include <string>

#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/share/common_ground.hpp"
#include "pointflight/share/share_link.hpp"
#include "tests/share/bus.hpp"

namespace {

using namespace pointflight;

/// Points of a floor.
class Floor : public CloudReader {
 public:
  bool read(std::vector<CloudPoint>& points) override {
    points.clear();
    for (int i = 0; i < 1600 && !done_; ++i) {
      points.push_back({{0.25 * (i % 40), 0.25 * (i / 40), 0.0}, 0.0f});
    }
    return !std::exchange(done_, true);
  }
  [[nodiscard]] bool has_intensity() const override { return false; }
  [[nodiscard]] double share_read() const override { return done_ ? 1.0 : 0.0; }

 private:
  bool done_ = false;
};

std::shared_ptr<const SurfelMap> floor_map() {
  ImportOptions options;
  options.resolution = 0.5;
  options.outliers.enabled = false;
  const Executor executor(1);
  const auto open = [](std::size_t) { return std::make_unique<Floor>(); };
  const ImportedMap map = build_map({"memory"}, open, options, executor);
  return SurfelMap::from_bytes(map_bytes(map.tree, map.description), "memory");
}

/// A run of each kind before its start.
struct Fixture {
  Fixture() {
    Scenario scenario;
    scenario.path = "s.yaml";
    scenario.duration = 10.0;
    scenario.vehicles.resize(2);
    for (std::size_t i = 0; i < 2; ++i) {
      scenario.vehicles[i].lidars.clear();
      scenario.vehicles[i].start = {4.0 + 1.5 * static_cast<double>(i), 5, 2};
    }
    const auto map = floor_map();
    for (const ShareTime time : {ShareTime::kFree, ShareTime::kLockstep}) {
      for (const OnLoss on_loss : {OnLoss::kVanish, OnLoss::kHold}) {
        ShareSetup setup;
        setup.time = time;
        setup.on_loss = on_loss;
        scenario.sections["share"] = setup;
        simulations.emplace_back(scenario, map, executor);
      }
    }
  }
  Executor executor{1};
  std::vector<Simulation> simulations;
};

template <class M>
std::vector<std::byte> told(M message, share_msg::Kind kind) {
  message.head.kind = kind;
  message.head.process = 2;
  return encode<Wire::kCdr>(message);
}

void listen(std::span<const std::uint8_t> data) {
  static Fixture fixture;
  Simulation simulation = fixture.simulations[data[0] % fixture.simulations.size()];
  const ShareSetup& setup = share_setup_of(simulation.scenario());
  std::int64_t now = 1'000'000'000;
  testing::Bus bus([&now] { return now; });
  const auto end = bus.join();
  FleetShareOptions options;
  options.run = "fuzz";
  options.process = "host:1";
  options.id = 1;
  options.vehicles = {0};
  options.settle = Duration{0};
  options.steady = [&now] { return now; };
  options.clock = [](std::int64_t at) {
    return std::optional(SimTime(Duration(at - 1'000'000'000)));
  };
  options.log = [](const std::string& line) {
    if (line.find('\n') != std::string::npos) __builtin_trap();
  };
  options.interrupted = [] { return true; };
  FleetShare share(simulation, *end, options);
  share.take_part(simulation);
  ShareLink link(simulation, share);
  share_msg::Introduction intro;
  intro.name = "host:2";
  intro.begins_at = 1000;  // younger
  intro.phase = share_msg::Phase::kFlying;
  intro.vehicles = {1};
  intro.parts = common_ground(simulation, setup.time == ShareTime::kFree ? 1.0 : 0.0);
  static_cast<void>(link.is_ready());
  bus.shout(ShareChannel::kMembers, told(intro, share_msg::Kind::kIntroduction));
  share_msg::States states;
  states.vehicles.resize(1);
  states.vehicles[0].number = 1;
  states.vehicles[0].position = {5.5, 5, 2};
  bus.shout(ShareChannel::kStates, told(states, share_msg::Kind::kStates));
  SampleFunction sink([](const Sample&) {});
  data = data.subspan(1);
  while (data.size() >= 3) {
    const auto channel = static_cast<ShareChannel>(data[0] % kShareChannels);
    const bool raw = data[0] % 8 < 4;
    const bool twice = data[0] % 16 < 8;
    const std::size_t size = std::min<std::size_t>(data[1], data.size() - 2);
    std::vector<std::byte> bytes;
    if (!raw) {
      share_msg::Head head;
      head.kind = static_cast<share_msg::Kind>(1 + data[0] % kShareChannels);
      head.process = 2;
      bytes = encode<Wire::kCdr>(head);
    }
    const auto body = std::as_bytes(data.subspan(2, size));
    bytes.insert(bytes.end(), body.begin(), body.end());
    if (bytes.empty()) bytes.resize(1);
    for (int k = 0; k < (twice ? 2 : 1); ++k) bus.shout(channel, bytes);
    data = data.subspan(2 + size);
    now += twice ? 1'000'000 : 700'000'000;
    if (!simulation.step(sink)) break;
    for (const Order& order : link.take_orders()) {
      if (const auto* skip = std::get_if<SkipOrder>(&order)) simulation.skip_to(skip->to);
    }
    if (!simulation.status(1).state.body.is_finite()) __builtin_trap();
  }
  static_cast<void>(share.peers());
  static_cast<void>(simulation.source_reports());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  try {
    listen({data, size});
  } catch (const InputError& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) __builtin_trap();
  }
  return 0;
}
