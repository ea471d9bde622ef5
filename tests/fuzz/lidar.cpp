// Any text as a sensor file, or as Ouster's metadata if it begins as JSON does: a sensor that
// can fire its first scan, or an InputError of one line.
#include <cstdint>
#include <string>
#include <string_view>

#include "pointflight/core/input_error.hpp"
#include "pointflight/lidar/beam_pattern.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/vendor_files.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const pointflight::LidarSettings settings =
        text.starts_with('{') ? pointflight::parse_ouster_metadata(text, "input.json")
                              : pointflight::parse_lidar(text, "input.yaml");
    const auto pattern = pointflight::make_pattern(settings);
    // scans of millions of beams are legal, but would stall the fuzzer
    constexpr double kPatience = 2e5;
    const bool small = settings.rotor.shot_rate < kPatience * settings.rate &&
                       settings.prisms.shot_rate < kPatience * settings.rate &&
                       settings.grid.columns * settings.grid.rows < 200000 &&
                       settings.csv.points_per_second < kPatience * settings.rate;
    if (small) static_cast<void>(pattern->beams(3, pointflight::Executor(1)));
  } catch (const pointflight::InputError& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) __builtin_trap();
  }
  return 0;
}
