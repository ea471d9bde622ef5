#include "pointflight/geometry/motion.hpp"

#include <gtest/gtest.h>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

SimTime at(double seconds) {
  return SimTime(from_seconds(seconds));
}

TEST(Motions, TracksAreKeptAndMounted) {
  EXPECT_THROW(PoseTrack(std::vector<TimedPose>{}), std::invalid_argument);
  EXPECT_THROW(PoseTrack({{at(1), {}}, {at(1), {}}}), std::invalid_argument);
  const Quaterniond turned = quaternion_from_rpy(0, 0, kPi / 2);
  const PoseTrack track({{at(1), {}}, {at(3), {turned, {4, 0, 0}}}});
  EXPECT_EQ(track.at(at(0)).translation, Vector3d::Zero());
  EXPECT_TRUE(track.at(at(2)).translation.isApprox(Vector3d(2, 0, 0)));
  EXPECT_EQ(track.at(at(9)).translation, Vector3d(4, 0, 0));
  EXPECT_DOUBLE_EQ(speed_max(Motion{track}), 2.0);
  EXPECT_DOUBLE_EQ(track.speed_max(at(4), at(5)), 0.0);
  // what sits on it turns with it
  const PoseTrack sensor = track.with_mount({Quaterniond::Identity(), {1, 0, 0}});
  EXPECT_TRUE(sensor.at(at(3)).translation.isApprox(Vector3d(4, 1, 0)));
  EXPECT_TRUE(sensor.with_mount({turned, {0, 1, 0}})
                  .at(at(3))
                  .translation.isApprox(
                      (track.at(at(3)) * Pose{Quaterniond::Identity(), {1, 1, 0}}).translation));
  // bits as without one
  EXPECT_EQ(track.with_mount({}).at(at(2.3)).translation, track.at(at(2.3)).translation);
}

TEST(Motions, RepeatAndTurnBack) {
  const PoseTrack to_and_fro(
      {{at(0), {}}, {at(1), {Quaterniond::Identity(), {1, 0, 0}}}, {at(2), {}}}, true);
  for (const double t : {0.0, 0.25, 1.5}) {
    EXPECT_TRUE(to_and_fro.at(at(t + 4)).translation.isApprox(to_and_fro.at(at(t)).translation));
  }
  StraightMotion ball;
  ball.from = at(1);
  ball.start = {1, 2, 3};
  ball.velocity = {2, 0, -1};
  EXPECT_EQ(ball.at(at(3)).translation, Vector3d(5, 2, 1));
  ball.walls.add({0, 0, 0});
  ball.walls.add({4, 4, 4});
  EXPECT_TRUE(ball.at(at(3)).translation.isApprox(Vector3d(3, 2, 1)));  // 5 is 1 beyond the wall
  for (double t = -20; t < 20; t += 0.37) {
    const Vector3d p = pose_at(Motion{ball}, at(t)).translation;
    EXPECT_GE(p.minCoeff(), 0.0);
    EXPECT_LE(p.maxCoeff(), 4.0);
  }
  EXPECT_DOUBLE_EQ(speed_max(Motion{ball}), std::sqrt(5.0));
  EXPECT_EQ(LoopMotion{}.at(at(7)).translation, Vector3d::Zero());
}

}  // namespace
}  // namespace pointflight
