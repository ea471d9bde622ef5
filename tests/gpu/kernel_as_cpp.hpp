// The kernel's text, which is C++ too.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "pointflight/gpu/internal/device_layout.hpp"

namespace pointflight::device {

struct uvec2 {
  uvec2() = default;
  uvec2(uint first, uint second) : x(first), y(second) {}
  uint x = 0, y = 0;
};
struct uvec4 {
  uint x, y, z, w;
};

inline float uintBitsToFloat(uint bits) {
  return std::bit_cast<float>(bits);
}
inline uint floatBitsToUint(float x) {
  return std::bit_cast<uint>(x);
}
inline uint bitfieldExtract(uint x, int first, int count) {
  return (x >> first) & ((1u << count) - 1u);
}
inline int bitCount(uint x) {
  return std::popcount(x);
}
inline int findLSB(uint x) {
  return x == 0 ? -1 : std::countr_zero(x);
}

/// One ray at a time, given or made of beams (`ray_of`): `start_way`, `step_node` and `step_leaf`
/// until `s.next` is kDone, `end_way`.
struct KernelAsCpp {
  MapNumbers map;
  const uvec4* nodes;
  const uvec2* words;
  DeviceCall call;
  const uint* given;
  const DeviceBeam* beams;
  const uint* tables;
  const uint* codes;
  float list[kMostTouched * kTouchedNumbers];

  [[nodiscard]] uvec4 node_at(uint i) const { return nodes[i]; }
  [[nodiscard]] uvec2 word_at(uint i) const { return words[i]; }

  static float abs(float x) { return std::fabs(x); }
  static float sqrt(float x) { return std::sqrt(x); }
  template <class T>
  static T min(T a, T b) {
    return std::min(a, b);
  }
  template <class T>
  static T max(T a, T b) {
    return std::max(a, b);
  }
#define precise
#define EXACT_BY 0
#include "pointflight/gpu/kernel/aim.glsl"
#include "pointflight/gpu/kernel/exact.glsl"
#include "pointflight/gpu/kernel/trace.glsl"
  float touched(int row, uint number) const {
    return list[static_cast<uint>(row) * kTouchedNumbers + number];
  }
  void set_touched(int row, uint number, float value) {
    list[static_cast<uint>(row) * kTouchedNumbers + number] = value;
  }
#include "pointflight/gpu/kernel/cone.glsl"
#include "pointflight/gpu/kernel/cone_end.glsl"
#include "pointflight/gpu/kernel/cone_way.glsl"
#undef EXACT_BY
#undef precise

  DeviceHit trace(const DeviceRay& ray) {
    start_way(ray);
    while (s.next != kDone) {
      if (s.next == kInner) {
        step_node();
      } else {
        step_leaf();
      }
    }
    return end_way();
  }

  /// Wide beam `i` of the call.
  WideResult trace_wide(uint i) {
    aim_across(i);
    start_cone(aimed_ray(i), across_x, across_y, across_z, beams[beam_of(i)].number);
    see_eight();
    while (c.next != kDone) {
      if (c.next == kInner) {
        step_cone_node();
      } else {
        step_cone_leaf();
      }
    }
    return end_cone();
  }
};

}  // namespace pointflight::device
