// Any bytes as a stream of MAVLink, in pieces of any length: the frames in it do not depend on the
// pieces, and what is read of them drives motors at speeds that they have.
#include "pointflight/sitl/internal/mavlink.hpp"

#include <algorithm>
#include <cstdint>

#include "pointflight/vehicle/motor_outputs.hpp"

namespace {

using namespace pointflight;

std::vector<mavlink::Frame> frames_of(std::span<const std::byte> stream, std::size_t piece) {
  mavlink::FrameReader reader;
  std::vector<mavlink::Frame> frames;
  for (std::size_t at = 0; at < stream.size(); at += piece) {
    reader.add(stream.subspan(at, std::min(piece, stream.size() - at)));
    while (auto frame = reader.next()) frames.push_back(std::move(*frame));
  }
  return frames;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const VehicleSettings vehicle = load_vehicle("quad_330");
  static const MotorOutputs motors(vehicle);
  if (size == 0) return 0;
  const auto stream = std::as_bytes(std::span(data, size)).subspan(1);
  const auto frames = frames_of(stream, 1 + data[0] % 64u);
  if (frames.size() != frames_of(stream, std::max<std::size_t>(1, stream.size())).size()) {
    __builtin_trap();
  }
  for (const mavlink::Frame& frame : frames) {
    const auto controls = mavlink::message_in<mavlink::HilActuatorControls>(frame);
    if (!controls) continue;
    for (const double speed : motors.speeds(controls->controls, controls->is_armed())) {
      if (!(speed >= 0.0 && speed <= vehicle.rotor.speed_max)) __builtin_trap();
    }
  }
  return 0;
}
