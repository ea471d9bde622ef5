// Any bytes as a campaign's study: its flights and a scenario with its values, or an InputError of
// one line.
#include <cstdint>
#include <string>

#include "pointflight/campaign/plan.hpp"
#include "pointflight/campaign/run_record.hpp"
#include "tests/fuzz/one_line.hpp"

namespace {

void plan(std::string_view text) {
  const pointflight::Study study = pointflight::parse_study(text, "study.yaml");
  double flights = static_cast<double>(study.seeds.size()) * static_cast<double>(study.draw_count);
  for (const pointflight::StudyAxis& axis : study.grid) {
    flights *= static_cast<double>(axis.values.size());
  }
  if (flights > 20'000.0) return;  // right, and slow to make
  const pointflight::Plan made = pointflight::plan_of(study);
  if (static_cast<double>(made.runs.size()) != flights) __builtin_trap();
  constexpr const char* kScenario = "map: m\nmission: {speed: 2}\nobstacles:\n  - {count: 1}\n";
  pointflight::edited_scenario(kScenario, made.keys, made.runs.front().values);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  pointflight::expect_one_line([&] { plan(text); });
  pointflight::expect_one_line([&] { pointflight::parse_record(text, "result.json"); });
  return 0;
}
