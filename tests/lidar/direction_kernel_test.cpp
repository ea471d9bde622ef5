#include "pointflight/lidar/internal/direction_kernel.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "pointflight/core/random.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

/// One ray, by vectors.
Vector3f turned_by_formula(const Vector3f& direction, double u, double v, double sigma) {
  const Vector3d d = direction.cast<double>();
  const Vector3d across =
      (std::abs(d.z()) < 0.9 ? d.cross(Vector3d::UnitZ()) : d.cross(Vector3d::UnitX()))
          .normalized();
  return (d + sigma * (u * across + v * d.cross(across))).normalized().cast<float>();
}

TEST(DirectionKernel, ManyRaysAreTheBitsOfSingleOnesWithEveryInstructionSet) {
  const std::size_t count = testing::repeats(std::size_t{200001});
  const RandomStream random(4, StreamId::kTest, 0);
  std::vector<double> u(count), v(count), x(count), y(count), z(count), unused(count);
  random.normal2(0, u, v);
  random.normal2(1u << 30u, x, y);
  random.normal2(1u << 31u, z, unused);
  std::vector<Ray> rays(count);
  for (std::size_t i = 0; i < count; ++i) {
    rays[i].direction_world = Vector3d(x[i], y[i], z[i]).normalized().cast<float>();
  }
  // along the axes
  for (int axis = 0; axis < 3; ++axis) rays[axis].direction_world = Vector3f::Unit(axis);
  for (const std::string& kernel : kernel_names()) {
    use_kernel(kernel);
    std::vector<Ray> turned = rays;
    turn_rays(turned.data(), count, u.data(), v.data(), 1e-3);
    for (std::size_t i = 0; i < count; ++i) {
      ASSERT_EQ(turned[i].direction_world,
                turned_by_formula(rays[i].direction_world, u[i], v[i], 1e-3))
          << kernel << ' ' << i;
    }
  }
  use_kernel("");
}

}  // namespace
}  // namespace pointflight
