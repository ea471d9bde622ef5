// Any bytes as a log of a flight controller: what is read is in order and finite.
#include "pointflight/flight_log/flight_log.hpp"

#include <cmath>
#include <cstdint>

#include "pointflight/core/input_error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace pointflight;
  try {
    const FlightLog log = parse_flight_log(std::as_bytes(std::span(data, size)), "fuzz");
    for (std::size_t i = 1; i < log.imu.size(); ++i) {
      if (!(log.imu[i].time > log.imu[i - 1].time)) __builtin_trap();
    }
    const RigidBodyState state =
        log.state_at(0.5 * (log.motion.front().time + log.motion.back().time));
    if (!state.is_finite()) __builtin_trap();
  } catch (const InputError&) {
  }
  return 0;
}
