#include "pointflight/map/import/internal/coordinate_steps.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pointflight {
namespace {

constexpr std::size_t kLooks = 256;         // points of a batch
constexpr double kFinest = 0.005;           // m: steps below do no harm
constexpr std::size_t kFewest = 100;        // points that say something
constexpr double kFloatSteps = 33554432.0;  // 2^25: a float's steps up to its value are fewer
constexpr double kFewestSteps = 1e5;        // up to the farthest: of fewer it is a lattice's

/// The greatest power of two that a number other than zero is a multiple of, as its exponent.
int binary_step(double value) {
  int exponent = 0;
  const double mantissa = std::frexp(value, &exponent);
  const auto bits = static_cast<std::int64_t>(std::ldexp(mantissa, 53));
  return exponent - 53 + __builtin_ctzll(static_cast<unsigned long long>(bits));
}

constexpr int kLeastDecimal = -6;
constexpr std::array kPowersOfTen = {
    1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};

double power_of_ten(int decimal) {
  return kPowersOfTen[static_cast<std::size_t>(decimal - kLeastDecimal)];
}

bool is_multiple_of_power_of_ten(double value, int decimal) {
  const double units = value / power_of_ten(decimal);
  return std::abs(units - std::round(units)) < 1e-6;
}

}  // namespace

void CoordinateSteps::add(std::span<const CloudPoint> points) {
  const std::size_t stride = std::max<std::size_t>(1, points.size() / kLooks);
  for (std::size_t i = 0; i < points.size(); i += stride) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double value = points[i].position[static_cast<int>(k)];
      if (!std::isfinite(value) || value == 0.0 || std::abs(value) > 1e15) continue;
      Axis& axis = axes_[k];
      axis.binary = std::min(axis.binary, binary_step(value));
      while (axis.decimal > kLeastDecimal && !is_multiple_of_power_of_ten(value, axis.decimal))
        --axis.decimal;
      axis.farthest = std::max(axis.farthest, std::abs(value));
      if (axis.count++ == 0) axis.first = value;
      axis.varies = axis.varies || value != axis.first;
    }
  }
}

std::optional<CoarseCoordinates> CoordinateSteps::coarse(double metres_per_unit) const {
  std::optional<CoarseCoordinates> found;
  for (const Axis& axis : axes_) {
    if (axis.count < kFewest || !axis.varies) continue;
    const double step = std::max(std::ldexp(1.0, axis.binary), power_of_ten(axis.decimal));
    const double steps = axis.farthest / step;
    const bool is_rounding = steps >= kFewestSteps && steps <= kFloatSteps;
    if (!is_rounding || step * metres_per_unit < kFinest) continue;
    if (!found || step > found->step) found = CoarseCoordinates{step, axis.farthest};
  }
  return found;
}

}  // namespace pointflight
