// Any bytes as what a flight of a campaign leaves (summary.json, timing.json, figures.json): a
// record that comes back from its own file the same, with tables of it, or an InputError of one
// line. The first line of the input names the file.
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "pointflight/campaign/run_record.hpp"
#include "pointflight/campaign/statistics.hpp"
#include "tests/fuzz/one_line.hpp"
#include "tests/fuzz/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;

void judge(const pointflight::RunRecord& record) {
  const std::string text = pointflight::record_json(record);
  if (pointflight::record_json(pointflight::parse_record(text, "result.json")) != text) {
    __builtin_trap();
  }
  const std::vector<const pointflight::RunRecord*> runs = {&record, &record};
  for (const std::string& column : pointflight::number_columns(runs)) {
    const pointflight::Spread spread = pointflight::spread_of(runs, column);
    if (!std::isfinite(spread.mean) || !(spread.least <= spread.greatest)) __builtin_trap();
  }
  const pointflight::Results results = {{0, record}};
  static_cast<void>(pointflight::timing_csv(results));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const pointflight::FuzzFolder folder;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t line = std::min(text.find('\n'), text.size());
  for (const char* name : {"summary.json", "timing.json", "figures.json"}) {
    if (text.substr(0, line) != name) continue;
    const fs::path file = folder.path() / name;
    const std::string_view content = text.substr(std::min(line + 1, text.size()));
    std::ofstream(file, std::ios::binary)
        .write(content.data(), static_cast<std::streamsize>(content.size()));
    pointflight::expect_one_line([&] {
      pointflight::RunRecord record;
      pointflight::read_results(folder.path().string(), "figures.json", record);
      judge(record);
    });
    fs::remove(file);
  }
  return 0;
}
