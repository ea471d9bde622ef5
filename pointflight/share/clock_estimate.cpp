#include "pointflight/share/clock_estimate.hpp"

#include <algorithm>
#include <cmath>

namespace pointflight {
namespace {

constexpr std::int64_t kWindow = 2'000'000'000;  // ns
constexpr std::size_t kMost = 64;                // samples

}  // namespace

void ClockEstimate::add(std::int64_t sent,
                        std::int64_t held,
                        std::int64_t arrived,
                        std::int64_t clock) {
  // others' figures: any
  if (held < 0 || held > kWindow || sent > arrived || sent < arrived - 2 * kWindow) return;
  const std::int64_t round = arrived - sent - held;
  if (round < 0) return;
  samples_.push_back({round, arrived - round / 2, clock});
  while (samples_.front().steady < arrived - kWindow || samples_.size() > kMost) {
    samples_.pop_front();
  }
}

std::optional<ClockEstimate::Reading> ClockEstimate::at(std::int64_t steady) const {
  if (samples_.empty()) return std::nullopt;
  const auto best =
      std::min_element(samples_.begin(), samples_.end(), [](const Sample& a, const Sample& b) {
        return a.round < b.round;
      });
  if (steady - best->steady > 2 * kWindow) return std::nullopt;  // it has fallen silent
  const double passed = rate_ * static_cast<double>(steady - best->steady);
  const auto half = static_cast<std::int64_t>(0.5 * rate_ * static_cast<double>(best->round));
  return Reading{best->clock + std::llround(passed), half};
}

}  // namespace pointflight
