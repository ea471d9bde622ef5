// Quotients and roots by residuals (kernel/exact.glsl), on a device that is as far off as Vulkan
// allows: 2.5 units in the last place for quotients, and roots as inverses of inverse roots.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "pointflight/core/random.hpp"

namespace pointflight {
namespace {

/// Moves a float by whole units in the last place.
float moved(float x, int units) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(
      static_cast<std::int32_t>(std::bit_cast<std::uint32_t>(x)) + units));
}

struct RoughDevice {
  using uint = std::uint32_t;
  int off = 0;

  static float fma(float a, float b, float c) { return std::fma(a, b, c); }
  static uint floatBitsToUint(float x) { return std::bit_cast<uint>(x); }
  static float uintBitsToFloat(uint x) { return std::bit_cast<float>(x); }
  [[nodiscard]] float rough_inverse(float x) const { return moved(1.0f / x, off); }
  [[nodiscard]] float rough_root(float x) const { return moved(std::sqrt(x), off); }
#define precise
#define EXACT_BY 1
#define ROUGH_INVERSE(x) rough_inverse(x)
#define ROUGH_ROOT(x) rough_root(x)
#include "pointflight/gpu/kernel/exact.glsl"
#undef ROUGH_ROOT
#undef ROUGH_INVERSE
#undef EXACT_BY
#undef precise
};

TEST(GpuExact, RootsAreExactNearOneToo) {
  const RandomStream random(1, StreamId::kTest, 0);
  for (const int off : {-3, -1, 0, 1, 3}) {
    RoughDevice device{off};
    float near = 1.0f;
    for (int i = 0; i < 20000; ++i) {
      for (const float x : {near, moved(1.0f, -i), moved(2.0f, i), moved(4.0f, -i)}) {
        ASSERT_EQ(device.root_of(x), std::sqrt(x)) << off << ' ' << x;
      }
      near = std::nextafter(near, 2.0f);
    }
    for (std::uint64_t i = 0; i < 200000; ++i) {
      const auto x = static_cast<float>(std::exp(random.uniform(i, -30.0, 30.0)));
      ASSERT_EQ(device.root_of(x), std::sqrt(x)) << off << ' ' << x;
    }
    EXPECT_EQ(device.root_of(0.0f), 0.0f);
    EXPECT_EQ(device.root_of(-1.0f), 0.0f);
  }
}

TEST(GpuExact, QuotientsAre) {
  const RandomStream random(2, StreamId::kTest, 0);
  for (const int off : {-2, -1, 0, 1, 2}) {
    RoughDevice device{off};
    for (std::uint64_t i = 0; i < 300000; ++i) {
      const auto a = static_cast<float>(std::exp(random.uniform(3 * i, -20.0, 20.0)));
      const auto b = static_cast<float>(std::exp(random.uniform(3 * i + 1, -20.0, 20.0)));
      const float signed_a = i % 2 == 0 ? a : -a;
      ASSERT_EQ(device.divided(signed_a, b), signed_a / b) << off << ' ' << signed_a << '/' << b;
      ASSERT_EQ(device.divided(1.0f, b), 1.0f / b) << off << " 1/" << b;
      // mantissas of ones, or nearly
      const float ones = moved(std::ldexp(1.0f, static_cast<int>(i % 40) - 20),
                               -1 - static_cast<int>(i / 40 % 30));
      ASSERT_EQ(device.divided(signed_a, ones), signed_a / ones)
          << off << ' ' << signed_a << '/' << ones;
    }
  }
}

}  // namespace
}  // namespace pointflight
