// Any text as keyframes of an obstacle or as a polynomial trajectory: motions that can be asked at
// any time, or an InputError of one line.
#include <cstdint>
#include <string>
#include <string_view>

#include "pointflight/core/input_error.hpp"
#include "pointflight/vehicle/trajectory.hpp"
#include "pointflight/world/obstacle_motion.hpp"

namespace {

template <class Action>
void try_to(const Action& action) {
  try {
    action();
  } catch (const pointflight::InputError& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) __builtin_trap();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace pointflight;  // NOLINT(google-build-using-namespace): this function only
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  for (const bool repeat : {false, true}) {
    try_to([&] {
      const auto motion = parse_keyframes(text, "input.csv", repeat);
      for (const double t : {-1.0, 0.0, 0.5, 3.0, 1e6}) {
        if (!motion.at(SimTime(from_seconds(t))).translation.allFinite()) __builtin_trap();
      }
    });
  }
  try_to([&] {
    const auto trajectory = PolynomialTrajectory::parse(text, "input.csv");
    for (const double t : {-1.0, 0.0, 0.5, 1e9}) static_cast<void>(trajectory->at(t));
  });
  return 0;
}
