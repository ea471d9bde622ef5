#include "pointflight/map/intensity_levels.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "pointflight/core/math.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kBuckets = 1 << 16;
constexpr std::size_t kUsualCodes = 240;  // of those that 99.9 % of the values have
constexpr double kUsualFraction = 0.999;

/// The order of floats as that of whole numbers.
std::uint32_t ordered(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  return (bits & 0x80000000u) != 0 ? ~bits : bits | 0x80000000u;
}
/// The greatest float whose number begins with these 16 bits.
float upper_end(std::size_t bucket) {
  const auto number = static_cast<std::uint32_t>(bucket << 16 | 0xffffu);
  return std::bit_cast<float>((number & 0x80000000u) != 0 ? number & 0x7fffffffu : ~number);
}

}  // namespace

IntensityLevels IntensityLevels::linear(float offset, float step) {
  IntensityLevels levels;
  levels.step = step;
  for (std::size_t code = 0; code < levels.of_code.size(); ++code) {
    levels.of_code[code] = offset + step * static_cast<float>(code);
  }
  return levels;
}

float IntensityLevels::usual_end() const {
  return of_code[kUsualCodes - 1];
}

std::uint8_t IntensityLevels::code_of(float intensity) const {
  if (is_linear) {
    if (!(step > 0.0f)) return 0;
    const float code = std::round((intensity - of_code.front()) / step);
    return static_cast<std::uint8_t>(std::clamp(code, 0.0f, 255.0f));
  }
  const auto above = std::lower_bound(of_code.begin(), of_code.end(), intensity);
  if (above == of_code.begin()) return 0;
  if (above == of_code.end()) return 255;
  const auto code = static_cast<std::size_t>(above - of_code.begin());
  const bool is_nearer_below = intensity - of_code[code - 1] < of_code[code] - intensity;
  return static_cast<std::uint8_t>(is_nearer_below ? code - 1 : code);
}

IntensityHistogram::IntensityHistogram()
    : counts_(kBuckets, 0),
      least_(std::numeric_limits<float>::infinity()),
      greatest_(-std::numeric_limits<float>::infinity()) {}

void IntensityHistogram::add(float intensity) {
  ++counts_[ordered(intensity) >> 16];
  ++count_;
  least_ = std::min(least_, intensity);
  greatest_ = std::max(greatest_, intensity);
}

IntensityLevels IntensityHistogram::levels() const {
  if (count_ == 0) return IntensityLevels::linear(0.0f, 0.0f);
  const float step = (greatest_ - least_) / 255.0f;
  const auto linear = IntensityLevels::linear(least_, std::isfinite(step) ? step : 0.0f);
  const double wanted = kUsualFraction * static_cast<double>(count_);
  std::uint64_t below = 0;
  std::size_t bucket = 0;
  while (bucket + 1 < kBuckets && static_cast<double>(below += counts_[bucket]) < wanted) {
    ++bucket;
  }
  const auto low = static_cast<double>(least_);
  const double usual = static_cast<double>(std::min(upper_end(bucket), greatest_)) - low;
  const double all = static_cast<double>(greatest_) - low;
  if (!(usual > 0.0) || !(all > 2.0 * usual) || !std::isfinite(all)) return linear;
  IntensityLevels levels;
  levels.is_linear = false;
  constexpr double kLastUsual = kUsualCodes - 1;
  for (std::size_t code = 0; code < levels.of_code.size(); ++code) {
    const auto k = static_cast<double>(code);
    const double beyond = (k - kLastUsual) / (255.0 - kLastUsual);
    const double value = code < kUsualCodes ? usual * k / kLastUsual
                                            : usual * math::exp(beyond * math::log(all / usual));
    levels.of_code[code] = static_cast<float>(low + value);
  }
  levels.of_code.back() = greatest_;
  return levels;
}

}  // namespace pointflight
