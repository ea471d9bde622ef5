// Any bytes as a recording: read as far as it goes, or an InputError of one line.
#include <cstdint>
#include <string>

#include "pointflight/core/input_error.hpp"
#include "recording/mcap_reader.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    std::size_t bytes = 0;
    pointflight::read_mcap_bytes(
        std::as_bytes(std::span(data, size)),
        "input.mcap",
        [&](const pointflight::RecordedMessage& message) { bytes += message.data.size(); });
  } catch (const pointflight::InputError& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) __builtin_trap();
  }
  return 0;
}
