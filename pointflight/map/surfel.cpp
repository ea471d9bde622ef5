#include "pointflight/map/surfel.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace pointflight {
namespace {

constexpr int kPlaceSteps = 64;  // per voxel
constexpr int kTurnMax = 127;    // steps of a quaternion's parts
constexpr float kQuaternionStep = 0.70711f / kTurnMax;
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

/// Steps of a quaternion's x, y, z, each from -127 to 127.
using QuaternionSteps = std::array<int, 3>;

int nearest_integer(float value) {
  return static_cast<int>(value + (value < 0.0f ? -0.5f : 0.5f));
}

QuaternionSteps nearest_steps(const Eigen::Quaternionf& q) {
  QuaternionSteps steps{};
  for (std::size_t k = 0; k < 3; ++k) {
    steps[k] = std::clamp(
        nearest_integer(q.vec()[static_cast<int>(k)] / kQuaternionStep), -kTurnMax, kTurnMax);
  }
  return steps;
}

/// The steps near the nearest ones whose normal is the best, which matters far more than how a
/// surfel is turned about it: for a beam at 1 degree to the plane 0.3 degrees of the former are
/// 15 mm of range 5 cm off the centre; 2 degrees of the latter move its outline by 2 mm there.
QuaternionSteps steps_for_normal(const Eigen::Quaternionf& q) {
  constexpr int kReach = 2;
  constexpr float kSpinWeight = 0.06f;  // of turns about the normal
  const QuaternionSteps nearest = nearest_steps(q);
  // q + dq turns q by twice w dv - dw v - v x dv in its own axes, with dw = -v.dv / w for unit
  // length
  const Vector3f v = q.vec();
  Matrix3f turns = q.w() * Matrix3f::Identity() + v * v.transpose() / q.w();
  for (int k = 0; k < 3; ++k) turns.col(k) -= v.cross(Vector3f::Unit(k));
  turns.row(0) *= kSpinWeight;
  const Vector3f off = Vector3f(static_cast<float>(nearest[0]),
                                static_cast<float>(nearest[1]),
                                static_cast<float>(nearest[2])) -
                       v / kQuaternionStep;
  const Vector3f at_nearest = turns * off;
  const Vector3f along_z = turns.col(2) / turns.col(2).squaredNorm();
  QuaternionSteps best = nearest;
  float least = at_nearest.squaredNorm();
  for (int i = -kReach; i <= kReach; ++i) {
    for (int j = -kReach; j <= kReach; ++j) {
      const Vector3f without_z =
          at_nearest + static_cast<float>(i) * turns.col(0) + static_cast<float>(j) * turns.col(1);
      const int k = nearest_integer(-without_z.dot(along_z));
      const float here = (without_z + static_cast<float>(k) * turns.col(2)).squaredNorm();
      if (here >= least) continue;
      const QuaternionSteps steps = {nearest[0] + i, nearest[1] + j, nearest[2] + k};
      if (std::any_of(
              steps.begin(), steps.end(), [](int step) { return std::abs(step) > kTurnMax; })) {
        continue;
      }
      least = here;
      best = steps;
    }
  }
  return best;
}

/// Steps of a centre along one axis, from 0 to 1023.
int nearest_position(float center_voxels) {
  return static_cast<int>(std::clamp(center_voxels * kPlaceSteps, 0.0f, 1023.0f));
}

/// The steps within one of the nearest ones, in the same voxel, that lie best in the surfel's
/// plane: a shift within it by a 64th of a voxel shows nowhere, one off it in every range.
std::array<int, 3> place_for_plane(const Vector3f& center_voxels, const Vector3f& normal) {
  constexpr float kShiftWeight = 0.01f;  // of squared shifts
  std::array<int, 3> nearest{};
  std::array<float, 3> off{};
  std::array<int, 3> low{};
  std::array<int, 3> high{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float at = center_voxels[static_cast<int>(axis)];
    const int place = nearest_position(at);
    nearest[axis] = place;
    off[axis] = static_cast<float>(place) + 0.5f - at * kPlaceSteps;
    low[axis] = place % kPlaceSteps == 0 ? 0 : -1;
    high[axis] = place % kPlaceSteps == kPlaceSteps - 1 ? 0 : 1;
  }
  std::array<int, 3> best = nearest;
  float least = 1e9f;
  for (int i = low[0]; i <= high[0]; ++i) {
    const float x = off[0] + static_cast<float>(i);
    for (int j = low[1]; j <= high[1]; ++j) {
      const float y = off[1] + static_cast<float>(j);
      for (int k = low[2]; k <= high[2]; ++k) {
        const float z = off[2] + static_cast<float>(k);
        const float across = x * normal.x() + y * normal.y() + z * normal.z();
        const float here = across * across + kShiftWeight * (x * x + y * y + z * z);
        if (here >= least) continue;
        least = here;
        best = {nearest[0] + i, nearest[1] + j, nearest[2] + k};
      }
    }
  }
  return best;
}

}  // namespace

SurfelWord encode(const Surfel& surfel) {
  const std::uint64_t thickness = code_of_thickness(surfel.s[0]);
  const bool planar = thickness == 0;
  const Eigen::Quaternionf q = largest_w(surfel.axes);
  const QuaternionSteps turn = planar ? steps_for_normal(q) : nearest_steps(q);
  const std::array<int, 3> place = planar
                                       ? place_for_plane(surfel.center_voxels, surfel.axes.col(0))
                                       : std::array{nearest_position(surfel.center_voxels.x()),
                                                    nearest_position(surfel.center_voxels.y()),
                                                    nearest_position(surfel.center_voxels.z())};
  SurfelWord word = thickness << 30;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    word |= static_cast<SurfelWord>(place[axis]) << (10 * axis);
    word |= static_cast<SurfelWord>(static_cast<std::uint8_t>(turn[axis])) << (32 + 8 * axis);
  }
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
