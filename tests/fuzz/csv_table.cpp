// Any text as a table of beam angles: numbers, or an InputError of one line.
#include "pointflight/io/csv_table.hpp"

#include <cstdint>
#include <string>
#include <string_view>

#include "pointflight/core/input_error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const pointflight::CsvTable table(text, "input.csv");
    const int column = table.require("azimuth");
    for (std::size_t row = 0; row < table.rows(); ++row) static_cast<void>(table.at(row, column));
  } catch (const pointflight::InputError& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) __builtin_trap();
  }
  return 0;
}
