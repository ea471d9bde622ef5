#include "tests/flight_log/flown_log.hpp"

#include <cmath>
#include <limits>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/vehicle/autopilot.hpp"
#include "pointflight/vehicle/imu.hpp"
#include "pointflight/vehicle/motor_outputs.hpp"
#include "pointflight/vehicle/multirotor.hpp"

namespace pointflight {
namespace {

/// Normals of a flight, one after the other.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : stream_(seed, StreamId::kMissionSearch, 77) {}
  double normal() { return stream_.normal(index_++); }
  Vector3d vector() { return {normal(), normal(), normal()}; }

 private:
  RandomStream stream_;
  std::uint64_t index_ = 0;
};

/// Another velocity each second, another heading.
Command wander(Draws& draws, bool hovers) {
  VelocityCommand command;
  if (!hovers) {
    command.v_world = {4.0 * draws.normal(), 4.0 * draws.normal(), 1.5 * draws.normal()};
    command.yaw_rate = draws.normal();
    command.turn = true;
  }
  return command;
}

}  // namespace

FlightLog flown_log(const VehicleSettings& vehicle, const FlownLogOptions& options) {
  const Multirotor multirotor(vehicle);
  const Autopilot autopilot(vehicle, Duration{0});
  const MotorOutputs motors(vehicle);
  Draws draws(options.seed);
  const Imu imu(vehicle, options.seed, 0);
  Imu::Memory memory;
  VehicleState state = multirotor.hover_at({0, 0, 20}, 0.3);
  AutopilotState pilot = autopilot.start(state.body, false);
  FlightLog log;
  log.path = "flown.ulg";
  log.firmware = "PX4";
  log.outputs_from = "actuator_motors";
  constexpr double kStep = 0.001;
  const int every = static_cast<int>(std::lround(1.0 / (options.rate * kStep)));
  const auto steps = static_cast<int>(std::lround(options.duration / kStep));
  std::vector<double> speeds;
  for (int i = 0; i <= steps; ++i) {
    const double time = i * kStep;
    const SimTime now{std::chrono::duration_cast<Duration>(std::chrono::duration<double>(time))};
    if (i % 1000 == 0) autopilot.give(pilot, wander(draws, options.hovers), now, state.body);
    if (i % every == 0) {
      speeds = autopilot.rotor_speeds(pilot, state.body, false, now, every * kStep);
      const auto sample = imu.sample(i / every, now, state, multirotor.acceleration(state), memory);
      log.imu.push_back({time,
                         options.is_noisy ? sample.gyro : state.body.omega_body,
                         options.is_noisy
                             ? sample.accel
                             : specific_force_body(state.body.q_world_body,
                                                   multirotor.acceleration(state).a_world)});
      LoggedOutputs& outputs = log.outputs.emplace_back();
      outputs.time = time;
      for (const std::size_t rotor : motors.rotors()) {
        outputs.outputs.push_back(
            static_cast<float>(std::clamp(motors.output_of(speeds[rotor]), 0.0, 1.0)));
      }
      const double noise = options.is_noisy ? 1.0 : 0.0;
      const Vector3d tilt = noise * 0.003 * draws.vector();
      log.attitude.push_back(
          {time,
           (state.body.q_world_body * quaternion_from_rpy(tilt.x(), tilt.y(), tilt.z()))
               .normalized()});
      log.motion.push_back({time,
                            state.body.p_world + noise * 0.02 * draws.vector(),
                            state.body.v_world + noise * 0.03 * draws.vector()});
    }
    multirotor.step(state, speeds, kStep);
  }
  return log;
}

}  // namespace pointflight
