// PX4's side of `fly --px4` as fast as it can be: connects, arms at two seconds, hovers at a fixed
// output, answers at once. For costs (bench/sitl.py) and for days of traffic (`./dev soak`).
//
//   px4_peer PORT [SECONDS]     prints messages, the last time (us) and a hash of all HIL_SENSORs;
//                               exit code 1 if a time was left out or came twice
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "pointflight/core/hash.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/sitl/internal/mavlink.hpp"
#include "pointflight/sitl/internal/socket.hpp"

using namespace pointflight;

namespace {

struct Seen {
  std::uint64_t count = 0;
  std::uint64_t last = 0;  // us
  std::uint64_t first_gap = 0;
  bool is_even = true;
  std::uint64_t hash = 0;
};

void take(const mavlink::Frame& frame, const mavlink::HilSensor& sensor, Seen& seen) {
  if (seen.count == 1) seen.first_gap = sensor.time_usec - seen.last;
  if (seen.count > 1 && sensor.time_usec - seen.last != seen.first_gap) seen.is_even = false;
  seen.last = sensor.time_usec;
  ++seen.count;
  seen.hash = 1099511628211u * (seen.hash ^ hash64(frame.payload));
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 2) throw InputError("usage: px4_peer PORT [SECONDS]");
  const auto port = static_cast<std::uint16_t>(std::strtoul(argv[1], nullptr, 10));
  const double seconds = argc > 2 ? std::strtod(argv[2], nullptr) : 1e9;
  Socket socket = Socket::connect_tcp("127.0.0.1", port, std::chrono::seconds(60));
  mavlink::FrameReader reader;
  mavlink::FrameWriter writer(1, 1);
  Seen seen;
  std::vector<std::byte> out;
  mavlink::Heartbeat heartbeat;
  heartbeat.autopilot = 12;
  writer.append(heartbeat, out);
  while (socket.send(out)) {
    out.clear();
    socket.wait(std::chrono::seconds(5));
    const auto bytes = socket.receive();
    if (!bytes) break;
    reader.add(*bytes);
    while (const auto frame = reader.next()) {
      const auto sensor = mavlink::message_in<mavlink::HilSensor>(*frame);
      if (!sensor) continue;
      take(*frame, *sensor, seen);
      mavlink::HilActuatorControls controls;
      controls.time_usec = sensor->time_usec;
      controls.flags = 1;
      const bool is_armed = sensor->time_usec > 2000000;
      for (std::size_t i = 0; i < 4 && is_armed; ++i) controls.controls[i] = 0.1f;
      controls.mode = is_armed ? 128 : 0;
      writer.append(controls, out);
    }
    if (static_cast<double>(seen.last) * 1e-6 >= seconds) break;
  }
  std::printf("%llu messages, %llu us, hash %016llx%s\n",
              static_cast<unsigned long long>(seen.count),
              static_cast<unsigned long long>(seen.last),
              static_cast<unsigned long long>(seen.hash),
              seen.is_even ? "" : ", with gaps");
  return seen.is_even ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "px4_peer: %s\n", error.what());
  return 2;
}
