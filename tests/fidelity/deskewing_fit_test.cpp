// Motion that is left within scans: found where it is, and only there.
#include "pointflight/fidelity/deskewing_fit.hpp"

#include <gtest/gtest.h>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::map_of;

/// A hall of 30 x 20 x 6 m with a few boxes in it.
ShapeScene hall_with_boxes() {
  ShapeScene scene;
  scene.add_box({-15, -10, 0}, {15, 10, 6});
  scene.add_box({4, 2, 0}, {6, 5, 2});
  scene.add_box({-8, -6, 0}, {-5, -5, 3});
  return scene;
}

class DeskewingFitTest : public ::testing::Test {
 protected:
  static constexpr int kScans = 12;

  [[nodiscard]] std::vector<RealScan> scans_of(const LidarSettings& sensor) const {
    Surroundings where;
    where.reflectivity = 0.3;
    const Lidar lidar(sensor, 0, nullptr, where);
    std::vector<RealScan> scans;
    for (int i = 0; i < kScans; ++i) {
      const Pose pose{quaternion_from_rpy(0.02, -0.03, 0.7 * i),
                      {-6.0 + 1.1 * i, 0.5 * (i % 3), 1.5}};
      ScanRequest request;
      request.index = static_cast<std::uint64_t>(i);
      request.start = SimTime(i * std::chrono::seconds(3));
      request.seed = 77;
      RealScan real{"scan", pose, {}};
      for (const ScanPoint& point :
           lidar.take(request, PoseTrack(pose), *renderer_, executor_).points) {
        real.rays.push_back(survey_ray(pose, point.position_sensor.cast<double>(), true));
      }
      scans.push_back(std::move(real));
    }
    return scans;
  }

  [[nodiscard]] DeskewingFit fit(const LidarSettings& sensor) const {
    return fit_deskewing(scans_of(sensor), sensor, *map_, *renderer_, executor_);
  }

  Executor executor_{2};
  std::shared_ptr<const SurfelMap> map_ = map_of(hall_with_boxes(), 0.1);
  std::unique_ptr<Renderer> renderer_ = make_renderer("beam", Scene{map_});
};

TEST_F(DeskewingFitTest, MotionOfEachScanIsFound) {
  LidarSettings sensor = load_lidar("os0_32");
  sensor.deskewing = {0.15, 0.02};
  const DeskewingFit found = fit(sensor);
  ASSERT_EQ(found.motions.size(), static_cast<std::size_t>(kScans));
  double rotations = 0.0;
  double translations = 0.0;
  for (int i = 0; i < kScans; ++i) {
    const ResidualMotion drawn =
        residual_motion(sensor.deskewing, 77, 0, SimTime(i * std::chrono::seconds(3)));
    rotations += drawn.rotation.squaredNorm() / (3.0 * kScans);
    translations += drawn.translation.squaredNorm() / (3.0 * kScans);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(found.motions[i].rotation[k], drawn.rotation[k], 0.04 * kDegree) << i;
      EXPECT_NEAR(found.motions[i].translation[k], drawn.translation[k], 0.005) << i;
    }
  }
  EXPECT_TRUE(found.rotation.shows());
  EXPECT_TRUE(found.translation.shows());
  EXPECT_NEAR(found.rotation.sigma, std::sqrt(rotations), 0.02 * kDegree);
  EXPECT_NEAR(found.translation.sigma, std::sqrt(translations), 0.002);
}

TEST_F(DeskewingFitTest, Slow_WithoutMotionNoneIsFound) {
  const DeskewingFit found = fit(load_lidar("os0_32"));
  EXPECT_LT(found.rotation.sigma, 0.03 * kDegree);
  EXPECT_LT(found.translation.sigma, 0.004);
}

TEST_F(DeskewingFitTest, Slow_ASensorThatDoesNotSpinTellsNothing) {
  LidarSettings sensor = load_lidar("avia");
  sensor.deskewing = {0.15, 0.02};
  EXPECT_TRUE(fit(sensor).motions.empty());
}

}  // namespace
}  // namespace pointflight
