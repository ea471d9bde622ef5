// Noise of beams' directions, in lanes.
#include "pointflight/lidar/internal/direction_kernel.hpp"

#include <algorithm>

#include "pointflight/core/internal/simd_targets-inl.hpp"
// for foreach_target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pointflight/lidar/internal/direction_kernel.cpp"
#include <hwy/foreach_target.h>
// after foreach_target
#include "pointflight/core/internal/math_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

struct VectorLanes {
  DoubleLanes x, y, z;
};

HWY_INLINE DoubleLanes length_of(const VectorLanes& a) {
  return hn::Sqrt(hn::Add(hn::Mul(a.x, a.x), hn::Add(hn::Mul(a.y, a.y), hn::Mul(a.z, a.z))));
}

HWY_INLINE DoubleLanes difference_of_products(DoubleLanes a,
                                              DoubleLanes b,
                                              DoubleLanes c,
                                              DoubleLanes d) {
  return hn::Sub(hn::Mul(a, b), hn::Mul(c, d));
}

/// (d + sigma (u a + v d x a)) normalised; a: across d, by d x z or, near the vertical, d x x.
HWY_INLINE VectorLanes turned_lanes(const VectorLanes& d,
                                    DoubleLanes u,
                                    DoubleLanes v,
                                    DoubleLanes sigma) {
  const DoubleLanes zero = hn::Zero(kD);
  const auto is_level = hn::Lt(hn::Abs(d.z), hn::Set(kD, 0.9));
  VectorLanes a{hn::IfThenElse(is_level, d.y, zero),
                hn::IfThenElse(is_level, hn::Neg(d.x), d.z),
                hn::IfThenElse(is_level, zero, hn::Neg(d.y))};
  const DoubleLanes length = length_of(a);
  a = {hn::Div(a.x, length), hn::Div(a.y, length), hn::Div(a.z, length)};
  const VectorLanes b{difference_of_products(d.y, a.z, d.z, a.y),
                      difference_of_products(d.z, a.x, d.x, a.z),
                      difference_of_products(d.x, a.y, d.y, a.x)};
  const auto moved = [&](DoubleLanes from, DoubleLanes along_a, DoubleLanes along_b) {
    return hn::Add(from, hn::Mul(sigma, hn::Add(hn::Mul(u, along_a), hn::Mul(v, along_b))));
  };
  const VectorLanes e{moved(d.x, a.x, b.x), moved(d.y, a.y, b.y), moved(d.z, a.z, b.z)};
  const DoubleLanes stretched = length_of(e);
  return {hn::Div(e.x, stretched), hn::Div(e.y, stretched), hn::Div(e.z, stretched)};
}

static void turn(Ray* rays, std::size_t count, const double* u, const double* v, double sigma) {
  // as many as lie in the nearest cache; vectors are read long after their numbers were written
  constexpr std::size_t kBlock = 64;
  HWY_ALIGN double x[kBlock] = {};
  HWY_ALIGN double y[kBlock] = {};
  HWY_ALIGN double z[kBlock] = {};
  HWY_ALIGN double first[kBlock] = {};
  HWY_ALIGN double second[kBlock] = {};
  for (std::size_t i = 0; i < count; i += kBlock) {
    const std::size_t some = std::min(kBlock, count - i);
    for (std::size_t k = 0; k < some; ++k) {
      x[k] = static_cast<double>(rays[i + k].direction_world.x());
      y[k] = static_cast<double>(rays[i + k].direction_world.y());
      z[k] = static_cast<double>(rays[i + k].direction_world.z());
    }
    std::copy_n(u + i, some, first);
    std::copy_n(v + i, some, second);
    for (std::size_t k = 0; k < some; k += kDoubles) {
      const VectorLanes d{hn::Load(kD, x + k), hn::Load(kD, y + k), hn::Load(kD, z + k)};
      const VectorLanes made =
          turned_lanes(d, hn::Load(kD, first + k), hn::Load(kD, second + k), hn::Set(kD, sigma));
      hn::Store(made.x, kD, x + k);
      hn::Store(made.y, kD, y + k);
      hn::Store(made.z, kD, z + k);
    }
    for (std::size_t k = 0; k < some; ++k) {
      rays[i + k].direction_world = {
          static_cast<float>(x[k]), static_cast<float>(y[k]), static_cast<float>(z[k])};
    }
  }
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pointflight {
namespace {

HWY_EXPORT(turn);

}  // namespace

void turn_rays(Ray* rays, std::size_t count, const double* u, const double* v, double sigma) {
  HWY_DYNAMIC_DISPATCH(turn)(rays, count, u, v, sigma);
}

}  // namespace pointflight
#endif  // HWY_ONCE
