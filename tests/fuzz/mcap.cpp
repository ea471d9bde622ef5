// Any bytes as a recording: read as far as it goes, from the start and from any time on, or an
// InputError of one line.
#include <cstdint>
#include <string>

#include "pointflight/recording/mcap_reader.hpp"
#include "tests/fuzz/one_line.hpp"

namespace {

void read_from_any_time(std::span<const std::byte> bytes) {
  const auto recording = pointflight::timed_mcap(bytes, "input.mcap");
  const auto [start, end] = recording->range();
  if (start > end) __builtin_trap();
  pointflight::TimedMessage message;
  for (const std::int64_t time : {start, start + (end - start) / 2, end + 1}) {
    recording->seek(time);
    while (recording->next(message)) {
      if (message.channel >= recording->channels().size() || message.time < time) __builtin_trap();
    }
    recording->latched_before(time, [&](const pointflight::TimedMessage& latched) {
      if (latched.time >= time) __builtin_trap();
    });
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  pointflight::expect_one_line([&] { pointflight::read_mcap_bytes(bytes, "input.mcap"); });
  pointflight::expect_one_line([&] { read_from_any_time(bytes); });
  return 0;
}
