// Any text as a ROS 1 definition with any bytes after a zero: numbers, or nothing.
#include "pointflight/ros/common/ros1_definition.hpp"

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::uint8_t* end = data + size;
  const std::uint8_t* zero = std::find(data, end, 0);
  const std::string definition(data, zero);
  const std::uint8_t* first = zero == end ? end : zero + 1;
  pointflight::numbers_of(definition,
                          std::as_bytes(std::span(first, static_cast<std::size_t>(end - first))));
  return 0;
}
