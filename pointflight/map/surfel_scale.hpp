#pragma once

#include <bit>
#include <cstdint>

#include "pointflight/map/surfel.hpp"

namespace pointflight {

/// What decoding surfel words takes at one resolution: the word holds classes and codes.
struct SurfelScale {
  SurfelScale() : SurfelScale(1.0f) {}
  /// `r`: the map's resolution, m.
  explicit SurfelScale(float r) : r_squared(r * r), position_step(r / 64.0f) {
    for (int i = 0; i < 4; ++i) {
      thickness[i] = kThicknessClasses[i] * r;
      inverse_thickness[i] = 1.0f / thickness[i];
      widest[i] = i < 2 ? 0.0f : thickness[i] * thickness[i];
    }
    float value = 1.0f;
    for (int i = 0; i < 8; ++i, value *= 0.75f) {
      ratio[i] = value;
      inverse_ratio[i] = 1.0f / value;
    }
  }

  float r_squared;                      ///< r^2, m^2.
  float position_step;                  ///< Of the surfels' positions, m.
  alignas(16) float thickness[4] = {};  ///< s0 of each class, m.
  /// 1 / thickness.
  alignas(16) float inverse_thickness[4] = {};
  alignas(16) float widest[4] = {};  ///< s0^2 of the classes that can lie above s2^2, else 0.
  alignas(32) float ratio[8] = {};   ///< s1 / s2 of each code.
  /// 1 / ratio.
  alignas(32) float inverse_ratio[8] = {};
};

/// s2^2 of a surfel word's code of five bits, in r^2.
inline float variance2_of(std::uint32_t code) {
  return std::bit_cast<float>(0x3b6bedfau + code * 0x288000u);
}

}  // namespace pointflight
