// Any text as a naming profile: read, or an InputError of one line.
#include <cstdint>
#include <string>
#include <string_view>

#include "pointflight/core/input_error.hpp"
#include "pointflight/ros/common/profile.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    pointflight::parse_ros_profile(text, "input.yaml");
  } catch (const pointflight::InputError& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) __builtin_trap();
  }
  return 0;
}
