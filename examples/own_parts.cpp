// Parts of one's own, added by registration: a sensor that the scenario mounts by name, a
// controller that its vehicle flies with, a link that prints poses while the run goes on. Run
// scan_a_room first.
#include <cmath>
#include <cstdio>
#include <exception>

#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/run/run_loop.hpp"
#include "pointflight/vehicle/controller.hpp"

using namespace pointflight;

/// What a scenario may say of a barometer.
struct BarometerSettings {
  double rate = 50.0;  ///< Hz
  double noise = 2.0;  ///< Pa
};

void describe(SettingsVisitor& visitor, BarometerSettings& settings) {
  visitor.value({"rate", "Hz", "measurements a second", 0.1, 1000}, settings.rate);
  visitor.value({"noise", "Pa", "standard deviation", 0, 1000}, settings.noise);
}

/// Pressure at its height above the map's zero (ISO 2533).
class Barometer : public InstantSensor {
 public:
  Barometer(const SensorSite& site, const BarometerSettings& settings)
      : InstantSensor(settings.rate),
        site_(site),
        noise_(settings.noise),
        random_(site.seed, StreamId::kOwnSensors, site.vehicle << 8 | site.sensor) {}

  [[nodiscard]] Sample measure(const InstantInput& input, std::any& /*memory*/) const override {
    const double height = input.state.body.p_world.z();
    const double pressure = 101325.0 * math::pow(1.0 - 2.25577e-5 * height, 5.25588);
    const double noise = noise_ * random_.normal(static_cast<std::uint64_t>(input.index));
    return Measurement{site_.vehicle, site_.sensor, input.time, input.time, {pressure + noise}};
  }

 private:
  SensorSite site_;
  double noise_;  ///< Pa
  RandomStream random_;
};

/// Flies as the cascade does, but is asked for no more than 0.5 m/s on top of where it should be.
class Careful : public Controller {
 public:
  explicit Careful(const VehicleSettings& settings)
      : cascade_(make_controller("cascade", settings)) {}

  [[nodiscard]] std::vector<double> update(const RigidBodyState& state,
                                           const Setpoint& setpoint,
                                           double dt,
                                           ControllerMemory& memory) const override {
    Setpoint asked = setpoint;
    if (auto* position = std::get_if<PositionCommand>(&asked)) {
      const double speed = position->v_world.norm();
      if (speed > 0.5) position->v_world *= 0.5 / speed;
    }
    return cascade_->update(state, asked, dt, memory);
  }

 private:
  std::unique_ptr<Controller> cascade_;
};

/// Prints where vehicles are, twice a second, and what the barometer says.
class PosePrinter : public Link {
 public:
  void on_sample(const Sample& sample) override {
    if (const auto* m = std::get_if<Measurement>(&sample)) pressure_ = m->values.front();
    const auto* state = std::get_if<StateSample>(&sample);
    if (state == nullptr || state->time < next_) return;
    next_ = state->time + std::chrono::milliseconds(500);
    const Vector3d& p = state->state.body.p_world;
    std::printf("%.1f s: %.2f %.2f %.2f, %.0f Pa\n",
                to_seconds(state->time),
                p.x(),
                p.y(),
                p.z(),
                pressure_);
  }

 private:
  SimTime next_;
  double pressure_ = 0.0;
};

int main() try {
  sensor_kinds().add(sensor_kind<Barometer, BarometerSettings>(
      "barometer", "pressure at its height", {{"pressure", "Pa"}}));
  ControllerKind::table().add(
      {.name = "careful",
       .help = "the cascade, slowly",
       .make = [](const VehicleSettings& settings) { return std::make_unique<Careful>(settings); },
       .integrates_attitude = true,
       .tilt_max_deg = 85.0});
  const Scenario scenario = parse_scenario(R"(
map: room.pfmap
vehicle: {start: [2, 3, 1.5], controller: careful}
sensors: [{kind: barometer, rate: 20}]
mission: {speed: 1, waypoints: [[3.5, 3, 1.5], [3.5, 1.5, 2.5]]}
)",
                                           "own_parts.yaml");
  const Executor executor;
  Simulation simulation(scenario, scenario.open_map(), executor);
  RunLoop loop(simulation, {});
  PosePrinter printer;
  loop.add(printer);
  return loop.run() == RunEnd::kCompleted ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
