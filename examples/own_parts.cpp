// Parts of one's own, added by registration: a sensor that the scenario mounts by name, a
// controller that its vehicle flies with, a renderer that its LiDAR sees by, a link that prints
// poses while the run goes on, and a ROS message of the sensor, recorded as own_parts.mcap. Run
// scan_a_room first.
#include <cstdio>
#include <exception>
#include <filesystem>

#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/recording/mcap_writer.hpp"
#include "pointflight/recording/recording.hpp"
#include "pointflight/render/renderer.hpp"
#include "pointflight/ros/common/ros_link.hpp"
#include "pointflight/run/run_loop.hpp"
#include "pointflight/vehicle/controller.hpp"

using namespace pointflight;

/// What a scenario may say of a pressure probe.
struct PressureProbeSettings {
  double rate = 50.0;  ///< Hz
  double noise = 2.0;  ///< Pa
};

void describe(SettingsVisitor& visitor, PressureProbeSettings& settings) {
  visitor.value({"rate", "Hz", "measurements per second", 0.1, 1000}, settings.rate);
  visitor.value({"noise", "Pa", "standard deviation", 0, 1000}, settings.noise);
}

/// Pressure at its height above the map's zero (ISO 2533).
class PressureProbe : public InstantSensor {
 public:
  PressureProbe(const SensorSite& site, const PressureProbeSettings& settings)
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

/// Sees as the beam renderer does, but nothing beyond 3 m.
class Fog : public Renderer {
 public:
  explicit Fog(const Scene& scene) : clear_(make_renderer("beam", scene)) {}

 protected:
  void render_one(const RenderJob& job, const Executor& executor) const override {
    clear_->render({&job, 1}, executor);
    for (Hit& hit : job.hits) {
      if (hit.range > 3.0f) hit = {};
    }
  }

 private:
  std::unique_ptr<Renderer> clear_;
};

/// sensor_msgs/FluidPressure
struct FluidPressure {
  static constexpr msg::TypeName kType{"sensor_msgs", "FluidPressure"};
  msg::Header header;
  double fluid_pressure = 0.0;  ///< Pa
  double variance = 0.0;        ///< Pa^2; 0: unknown.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("fluid_pressure", m.fluid_pressure);
    v("variance", m.variance);
  }
};

FluidPressure pressure_message(const OutputStream& stream, const Measurement& measurement) {
  return {stream.header(measurement.time), measurement.values.front(), 0.0};
}

/// Prints where vehicles are, twice a second, and what the probe says.
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
  sensor_kinds().add(sensor_kind<PressureProbe, PressureProbeSettings>(
      "pressure_probe", "pressure at its height", {{"pressure", "Pa"}}));
  ControllerKind::table().add(
      {.name = "careful",
       .help = "the cascade, slowly",
       .make = [](const VehicleSettings& settings) { return std::make_unique<Careful>(settings); },
       .integrates_attitude = true,
       .tilt_max_deg = 85.0});
  RendererKind::table().add(
      {.name = "fog", .help = "nothing beyond 3 m", .make = [](const Scene& scene) {
         return std::make_unique<Fog>(scene);
       }});
  output_types().add({.name = "pressure",
                      .help = "what the probe says",
                      .make = per_sample<pressure_message>(),
                      .frame = OutputType::Frame::kBody,
                      .sensor = "pressure_probe"});
  const Scenario scenario = parse_scenario(R"(
map: room.pfmap
vehicle: {start: [2, 3, 1.5], controller: careful}
lidars: [{model: mid360, renderer: fog}]
sensors: [{kind: pressure_probe, rate: 20}]
mission: {speed: 1, waypoints: [[3.5, 3, 1.5], [3.5, 1.5, 2.5]]}
ros: {outputs: [{kind: pressure, topic: "/{vehicle}/pressure"}]}
)",
                                           "own_parts.yaml");
  const Executor executor;
  Simulation simulation(scenario, scenario.open_map(), executor);
  RunLoop loop(simulation, {});
  PosePrinter printer;
  loop.add(printer);
  RosLink ros(describe_run(simulation), profile_for(scenario), {});
  std::filesystem::remove("own_parts.mcap");
  ros.add_recording(std::make_unique<Recording>("own_parts.mcap",
                                                std::make_unique<McapWriter>("own_parts.mcap")));
  loop.add(ros);
  return loop.run() == RunEnd::kCompleted ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
