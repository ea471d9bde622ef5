// What deskewing leaves in scans: how much, how it changes from scan to scan, and in which scans.
#include "pointflight/lidar/residual_motion.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <vector>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/render/renderer.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::map_of;

constexpr DeskewingSettings kLeft{0.2, 0.03};

SimTime after(double seconds) {
  return SimTime(from_seconds(seconds));
}

TEST(ResidualMotion, PointsMoveInProportionToTheirTimeAndNotInTheMiddle) {
  ResidualMotion motion;
  motion.rotation = {0.0, 0.0, 0.01};
  motion.translation = {0.0, 0.02, 0.0};
  const Vector3f point(4.0f, 0.0f, 1.0f);
  EXPECT_EQ(motion.moved(point, 0.5), point);
  // turned by half of 0.01 rad at 4 m and shifted by half of 2 cm
  EXPECT_NEAR(motion.moved(point, 1.0).y(), 0.03, 1e-6);
  EXPECT_NEAR(motion.moved(point, 0.0).y(), -0.03, 1e-6);
  EXPECT_EQ(motion.moved(point, 1.0).z(), 1.0f);
}

TEST(ResidualMotion, IsOfTheGivenSizeAndChangesWithinSeconds) {
  constexpr int kDraws = 4000;
  Vector3d rotations = Vector3d::Zero();
  Vector3d translations = Vector3d::Zero();
  double after_a_second = 0.0;
  double after_five = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double t = 7.3 * i;
    const ResidualMotion motion = residual_motion(kLeft, 5, 2, after(t));
    rotations += motion.rotation.cwiseAbs2();
    translations += motion.translation.cwiseAbs2();
    const auto with = [&](double seconds) {
      return motion.translation.dot(residual_motion(kLeft, 5, 2, after(t + seconds)).translation);
    };
    after_a_second += with(1.0);
    after_five += with(5.0);
  }
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(std::sqrt(rotations[k] / kDraws), 0.2 * kDegree, 0.006 * kDegree);
    EXPECT_NEAR(std::sqrt(translations[k] / kDraws), 0.03, 0.001);
  }
  EXPECT_NEAR(after_a_second / translations.sum(), 0.58, 0.03);
  EXPECT_NEAR(after_five / translations.sum(), 0.0, 0.03);
  EXPECT_NE(residual_motion(kLeft, 5, 2, after(0)).rotation,
            residual_motion(kLeft, 5, 3, after(0)).rotation);
  EXPECT_NE(residual_motion(kLeft, 6, 2, after(0)).rotation,
            residual_motion(kLeft, 5, 2, after(0)).rotation);
}

/// A room of 10 x 8 x 3 m.
class DeskewedScanTest : public ::testing::Test {
 protected:
  DeskewedScanTest() { left_.deskewing = kLeft; }

  static ShapeScene room() {
    ShapeScene scene;
    scene.add_box({-5, -4, -1}, {5, 4, 2});
    return scene;
  }

  [[nodiscard]] std::vector<ScanPoint> points(const LidarSettings& settings,
                                              const ScanRequest& request,
                                              const PoseTrack& track) const {
    return Lidar(settings, 0, nullptr, Surroundings{})
        .take(request, track, *renderer_, executor_)
        .points;
  }

  /// The farthest that a point lies from where it is without residual motion, m.
  [[nodiscard]] double farthest(const ScanRequest& request, const PoseTrack& track) const {
    const std::vector<ScanPoint> exact = points(plain_, request, track);
    const std::vector<ScanPoint> moved = points(left_, request, track);
    EXPECT_EQ(exact.size(), moved.size());
    double most = 0.0;
    for (std::size_t i = 0; i < exact.size(); ++i) {
      EXPECT_EQ(exact[i].range, moved[i].range);
      most = std::max(
          most, static_cast<double>((exact[i].position_sensor - moved[i].position_sensor).norm()));
    }
    return most;
  }

  LidarSettings plain_ = load_lidar("vlp16");
  LidarSettings left_ = plain_;
  Executor executor_{2};
  std::unique_ptr<Renderer> renderer_ = make_renderer("beam", Scene{map_of(room(), 0.2)});
};

TEST_F(DeskewedScanTest, OnlyScansWithoutMotionHaveIt) {
  const Pose at{quaternion_from_rpy(0.0, 0.0, 0.3), {0.5, 0.3, 0.2}};
  const Pose next{quaternion_from_rpy(0.0, 0.0, 0.4), {0.6, 0.3, 0.2}};
  const PoseTrack moving({{SimTime{}, at}, {after(0.1), next}});
  ScanRequest request;
  request.seed = 3;
  EXPECT_GT(farthest(request, PoseTrack(at)), 0.005);
  EXPECT_EQ(farthest(request, moving), 0.0);
  request.snapshot = true;
  EXPECT_GT(farthest(request, moving), 0.005);
  request.noise = false;
  EXPECT_EQ(farthest(request, moving), 0.0);
}

TEST_F(DeskewedScanTest, PointsLieWhereTheMotionPutsThem) {
  ScanRequest request;
  request.seed = 11;
  request.start = after(12.0);
  const PoseTrack still(Pose{});
  const std::vector<ScanPoint> exact = points(plain_, request, still);
  const std::vector<ScanPoint> moved = points(left_, request, still);
  const ResidualMotion motion = residual_motion(kLeft, 11, 0, request.start);
  ASSERT_EQ(exact.size(), moved.size());
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const double time = to_seconds(exact[i].time_offset) / 0.1;
    EXPECT_EQ(moved[i].position_sensor, motion.moved(exact[i].position_sensor, time));
  }
}

TEST_F(DeskewedScanTest, FilesOfSuchScansAreReadBack) {
  const testing::TemporaryFolder folder;
  ScanRequest request;
  request.seed = 4;
  const Lidar lidar(left_, 0, nullptr, Surroundings{});
  const Scan scan = lidar.take(request, PoseTrack(Pose{}), *renderer_, executor_);
  write_scan_pcd(folder / "s.pcd", scan);
  const std::vector<Beam> beams = lidar.beams(lidar.pattern_scan(0, 4), executor_);
  Scan read = scan;
  read.points.clear();
  read_scan_points(folder / "s.pcd", beams, left_.deskewing, read);
  ASSERT_EQ(read.points.size(), scan.points.size());
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    EXPECT_EQ(read.points[i].beam, scan.points[i].beam);
    EXPECT_EQ(read.points[i].position_sensor, scan.points[i].position_sensor);
  }
  EXPECT_THROW(read_scan_points(folder / "s.pcd", beams, {}, read), InputError);
}

}  // namespace
}  // namespace pointflight
