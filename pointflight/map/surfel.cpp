#include "pointflight/map/surfel.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace pointflight {
namespace {

constexpr float kQuaternionStep = 0.70711f / 127.0f;
constexpr std::uint32_t kVarianceBase = 0x3b6bedfau;  // 0.06^2
constexpr std::uint32_t kVarianceStep = 0x288000u;    // about 12 % on the standard deviation

float spread_of_code(std::uint32_t code) {
  return std::sqrt(std::bit_cast<float>(kVarianceBase + code * kVarianceStep));
}

std::uint64_t code_of_spread(float spread) {
  static const std::array<float, 32> spreads = [] {
    std::array<float, 32> all{};
    for (std::uint32_t code = 0; code < 32; ++code) all[code] = spread_of_code(code);
    return all;
  }();
  // the nearer of the two around it
  const auto above = std::lower_bound(spreads.begin() + 1, spreads.end() - 1, spread);
  const bool lower = spread - *(above - 1) <= *above - spread;
  return static_cast<std::uint64_t>(above - spreads.begin()) - (lower ? 1 : 0);
}

std::uint64_t code_of_ratio(float ratio) {
  std::uint64_t best = 0;
  float value = 1.0f;
  float best_error = 1e9f;
  for (std::uint64_t code = 0; code < 8; ++code, value *= 0.75f) {
    if (std::abs(value - ratio) < best_error) {
      best_error = std::abs(value - ratio);
      best = code;
    }
  }
  return best;
}

std::uint64_t code_of_thickness(float s0) {
  std::uint64_t best = 0;
  for (std::uint64_t code = 1; code < 4; ++code) {
    if (std::abs(kThicknessClasses[code] - s0) < std::abs(kThicknessClasses[best] - s0)) {
      best = code;
    }
  }
  return best;
}

/// Of the four quaternions that differ by half turns about the body axes, the one with the largest
/// w.
Eigen::Quaternionf largest_w(const Matrix3f& axes) {
  Matrix3f right_handed = axes;
  if (right_handed.determinant() < 0.0f) right_handed.col(0) = -right_handed.col(0);
  const Eigen::Quaternionf q(right_handed);
  const Eigen::Quaternionf candidates[4] = {q,
                                            q * Eigen::Quaternionf(0, 1, 0, 0),
                                            q * Eigen::Quaternionf(0, 0, 1, 0),
                                            q * Eigen::Quaternionf(0, 0, 0, 1)};
  Eigen::Quaternionf best = q;
  for (const Eigen::Quaternionf& candidate : candidates) {
    if (std::abs(candidate.w()) > std::abs(best.w())) best = candidate;
  }
  best.normalize();
  if (best.w() < 0.0f) best.coeffs() = -best.coeffs();
  return best;
}

std::uint64_t code_of_component(float value) {
  const float steps = std::clamp(std::round(value / kQuaternionStep), -127.0f, 127.0f);
  return static_cast<std::uint8_t>(static_cast<std::int8_t>(steps));
}

}  // namespace

SurfelWord encode(const Surfel& surfel) {
  SurfelWord word = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float steps = std::clamp(std::floor(surfel.center_voxels[axis] * 64.0f), 0.0f, 1023.0f);
    word |= static_cast<SurfelWord>(steps) << (10 * axis);
  }
  const Eigen::Quaternionf q = largest_w(surfel.axes);
  word |= code_of_thickness(surfel.s[0]) << 30;
  word |= code_of_component(q.x()) << 32;
  word |= code_of_component(q.y()) << 40;
  word |= code_of_component(q.z()) << 48;
  word |= code_of_ratio(surfel.s[1] / surfel.s[2]) << 56;
  word |= code_of_spread(surfel.s[2]) << 59;
  return word;
}

Surfel decode(SurfelWord word) {
  Surfel surfel;
  surfel.center_voxels = center_voxels(word);
  const auto component = [word](int shift) {
    return static_cast<float>(static_cast<std::int8_t>(word >> shift)) * kQuaternionStep;
  };
  const float x = component(32);
  const float y = component(40);
  const float z = component(48);
  const float w = std::sqrt(std::max(0.0f, 1.0f - x * x - y * y - z * z));
  surfel.axes = Eigen::Quaternionf(w, x, y, z).toRotationMatrix();
  const float s2 = spread_of_code(static_cast<std::uint32_t>(word >> 59));
  float ratio = 1.0f;
  for (std::uint64_t k = 0; k < ((word >> 56) & 7u); ++k) ratio *= 0.75f;
  surfel.s = {kThicknessClasses[(word >> 30) & 3u], ratio * s2, s2};
  return surfel;
}

}  // namespace pointflight
