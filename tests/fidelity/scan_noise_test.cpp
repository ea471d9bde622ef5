#include "pointflight/fidelity/scan_noise.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pointflight/geometry/rotation.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

/// A sensor whose noise is known: no more than that of its ranges.
LidarSettings sensor_with(double range_sigma) {
  LidarSettings sensor = load_lidar("os0_64_2048");
  sensor.noise.range_sigma = range_sigma;
  sensor.noise.range_sigma_at_limit = range_sigma;
  sensor.noise.range_step = 0.0;
  sensor.optics.angle_sigma_deg = 0.0;
  sensor.optics.sub_rays = 1;
  return sensor;
}

TEST(ScanNoise, FindsTheNoiseOfBothSides) {
  ShapeScene scene;
  scene.add_box({-8, -6, 0}, {8, 6, 5});
  const auto renderer = make_renderer("beam", Scene{testing::map_of(scene, 0.1)});
  const Executor executor(2);
  Surroundings bright;
  bright.reflectivity = 0.8;
  const Pose pose{quaternion_from_rpy(0.03, 0.02, 0.4), {1.0, 0.5, 1.5}};
  const Lidar lidar(sensor_with(0.02), 0, nullptr, bright);
  ScanRequest request;
  request.seed = 77;  // not the draws of the comparison
  RealScan real{"scan", pose, {}};
  for (const ScanPoint& point : lidar.take(request, PoseTrack(pose), *renderer, executor).points) {
    real.rays.push_back(survey_ray(pose, point.position_sensor.cast<double>(), true));
  }
  const NoiseComparison noise =
      compare_noise({real}, sensor_with(0.008), bright, *renderer, executor);
  int counted = 0;
  for (const PlaneNoise& bin : noise.bins) {
    if (!NoiseComparison::counts(bin)) continue;
    ++counted;
    // the plane is one of points with noise, too: a twelfth of the variance at the most, and a
    // little of what is aside of it
    EXPECT_GT(bin.real, 0.9 * 0.02);
    EXPECT_LT(bin.real, 1.25 * 0.02);
    EXPECT_GT(bin.modelled, 0.9 * 0.008);
    EXPECT_LT(bin.modelled, 1.25 * 0.008);
  }
  EXPECT_GE(counted, 2);
}

TEST(ScanNoise, IsOfNothingWithoutScans) {
  ShapeScene scene;
  scene.add_box({-8, -6, 0}, {8, 6, 5});
  const auto renderer = make_renderer("beam", Scene{testing::map_of(scene, 0.1)});
  const NoiseComparison noise = compare_noise({}, sensor_with(0.01), {}, *renderer, Executor(1));
  EXPECT_TRUE(std::ranges::none_of(noise.bins, NoiseComparison::counts));
}

}  // namespace
}  // namespace pointflight
