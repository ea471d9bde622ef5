// A sensor's model beside scans that were made with it: it must find itself, and only itself.
#include "pointflight/fidelity/sensor_comparison.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/fidelity/blockage_fit.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::map_of;

/// A hall of 70 x 30 x 8 m with pillars.
ShapeScene hall() {
  ShapeScene scene;
  scene.add_box({-35, -15, 0}, {35, 15, 8});
  for (int i = -3; i <= 3; ++i) {
    scene.add_box({8.0 * i, 4, 0}, {8.0 * i + 0.3, 4.3, 8});
    scene.add_box({8.0 * i + 3, -6, 0}, {8.0 * i + 3.2, -5.8, 8});
  }
  return scene;
}

Surroundings reflecting(double reflectivity) {
  Surroundings where;
  where.reflectivity = reflectivity;
  return where;
}

class SensorComparisonTest : public ::testing::Test {
 protected:
  SensorComparisonTest() {
    sensor_.optics.angle_sigma_deg = 0.01;  // more takes beams across the limits of bins
    for (int i = 0; i < 3; ++i) add_scan(i);
  }

  void add_scan(int i) {
    // tilted, so that rings of beams do not lie on the limits of bins
    const Pose pose{quaternion_from_rpy(0.03, 0.02, 0.4 * i), {-12.0 + 11.0 * (i % 3), 1.0, 1.5}};
    ScanRequest request;
    request.index = static_cast<std::uint64_t>(i);
    request.seed = 1234;  // not the draws of the comparison
    const Lidar lidar(sensor_, 0, nullptr, reflecting(0.2));
    const Scan scan = lidar.take(request, PoseTrack(pose), *renderer_, executor_);
    RealScan real{"scan", pose, {}};
    for (const ScanPoint& point : scan.points) {
      real.rays.push_back(survey_ray(pose, point.position_sensor.cast<double>(), true));
    }
    scans_.push_back(std::move(real));
  }

  [[nodiscard]] SensorComparison against(const Surroundings& where) const {
    return compare_sensor(scans_, sensor_, where, *renderer_, executor_);
  }

  LidarSettings sensor_ = load_lidar("os0_32");
  Executor executor_{2};
  std::unique_ptr<Renderer> renderer_ = make_renderer("beam", Scene{map_of(hall(), 0.1)});
  std::vector<RealScan> scans_;
};

TEST_F(SensorComparisonTest, Statistics_AModelFindsItself) {
  const SensorComparison same = against(reflecting(0.2));
  EXPECT_EQ(same.beams, 3.0 * 32768.0);
  EXPECT_LT(same.blocked, 0.05 * same.beams);
  EXPECT_LT(same.share_distance().modelled, 0.02);
  EXPECT_GT(same.share_distance().plain, 0.1);
  EXPECT_EQ(same.share_distance().real, 0.0);
  EXPECT_LT(same.edge_distance().modelled, 0.1);
  EXPECT_GT(same.edge_distance().plain, 0.25);
  double real = 0.0;
  double fired = 0.0;
  for (const auto& row : same.shares) {
    for (const ReturnShare& share : row) {
      real += share.returns.real;
      fired += share.beams;
      EXPECT_LE(share.returns.plain, share.beams);
    }
  }
  EXPECT_NEAR(real, static_cast<double>(same.returns), 0.03 * real);
  EXPECT_NEAR(fired + same.blocked, same.beams, 0.02 * fired) << "the hall is closed";
}

TEST_F(SensorComparisonTest, Statistics_AnotherReflectivityIsFartherOff) {
  if (testing::kSanitized) GTEST_SKIP() << "numbers; the code is that of the other tests";
  EXPECT_GT(against(reflecting(0.9)).share_distance().modelled, 0.06);
  EXPECT_GT(against(reflecting(0.06)).share_distance().modelled, 0.06);
}

TEST_F(SensorComparisonTest, Statistics_DirectionsThatSomethingBlocksDoNotCount) {
  if (testing::kSanitized) GTEST_SKIP() << "numbers; the code is that of the other tests";
  for (RealScan& scan : scans_) {  // the mast behind the sensor
    std::erase_if(scan.rays, [&](const SurveyRay& ray) {
      const Vector3d p = scan.T_world_sensor.inverse() * ray.point_world();
      return p.x() < -std::abs(p.y());
    });
  }
  const SensorComparison made = against(reflecting(0.2));
  EXPECT_NEAR(made.blocked, 0.25 * made.beams, 0.05 * made.beams);
  EXPECT_LT(made.share_distance().modelled, 0.03);
}

TEST_F(SensorComparisonTest, Statistics_WhatIsInTheWayIsFound) {
  if (testing::kSanitized) GTEST_SKIP() << "numbers; the code is that of the other tests";
  const auto is_blocked = [](double azimuth, double elevation) {
    return std::abs(azimuth) >= 140.0 && elevation < -20.0;  // steeper floor does not tell
  };
  for (int i = 3; i < 9; ++i) add_scan(i);
  for (RealScan& scan : scans_) {
    std::erase_if(scan.rays, [&](const SurveyRay& ray) {
      const Vector3d p = scan.T_world_sensor.inverse() * ray.point_world();
      return is_blocked(std::atan2(p.y(), p.x()) / kDegree, std::asin(p.z() / p.norm()) / kDegree);
    });
  }
  const BlockageFit fit = fit_blockage(scans_, sensor_, reflecting(0.2), *renderer_, executor_);
  EXPECT_EQ(fit.scans, 9u);
  EXPECT_GT(fit.told, 0.25);
  EXPECT_NEAR(fit.explained, fit.returns, 0.015);
  EXPECT_GT(fit.modelled, fit.returns + 0.04);
  const Blockage found(fit.sectors);
  int right = 0;
  int all = 0;
  for (double elevation = -42.0; elevation < 40.0; elevation += 4.0) {
    for (double azimuth = -178.0; azimuth < 180.0; azimuth += 4.0) {
      const bool truth = is_blocked(azimuth, elevation);
      const double near_rim =
          std::min(std::abs(std::abs(azimuth) - 140.0), std::abs(elevation + 20.0));
      if (near_rim < 5.0) continue;  // cells lie across it
      const double a = azimuth * kDegree;
      const double e = elevation * kDegree;
      const Vector3d d(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
      right += std::abs(found.share(d.cast<float>()) - (truth ? 1.0 : 0.0)) < 0.25 ? 1 : 0;
      ++all;
    }
  }
  EXPECT_GT(right, 0.97 * all);
  scans_.resize(1);
  scans_[0].rays.clear();
  EXPECT_THROW(fit_blockage(scans_, sensor_, reflecting(0.2), *renderer_, executor_), InputError);
}

}  // namespace
}  // namespace pointflight
