// What a ROS 2 node can make pointflight do, and what it cannot.
#include <chrono>
#include <cmath>
#include <thread>
#include <vector>

#include "tests/ros2/fixture.hpp"

namespace pointflight {
namespace {

using testing::eventually;
using testing::Peer;
using testing::Reader;
using testing::Ros2;
using testing::Writer;

/// What comes in, from reliable and from best-effort senders.
class Ros2Inputs : public Ros2, public ::testing::WithParamInterface<bool> {};
INSTANTIATE_TEST_SUITE_P(Reliable, Ros2Inputs, ::testing::Bool());

TEST_P(Ros2Inputs, CommandsFlyTheVehicle) {
  const bool reliable = GetParam();
  const auto flight = fly();
  Peer peer;
  Reader<nav_msgs_msg_dds__Odometry_> odometry(
      peer, "rt/drone0/odom", nav_msgs_msg_dds__Odometry__desc, false);
  Vector3d p = Vector3d::Zero();
  Vector3d v = Vector3d::Zero();
  int seen = 0;
  const auto look = [&] {
    return odometry.take([&](const auto& m) {
      const auto& at = m.pose.pose.position;
      const auto& moves = m.twist.twist.linear;
      p = {at.x, at.y, at.z};
      v = {moves.x, moves.y, moves.z};
      ++seen;
    });
  };
  ASSERT_TRUE(eventually([&] { return look() > 0; })) << flight->stop();
  const Vector3d start = p;

  /// Sends until the vehicle does what is asked for.
  const auto obeys = [&](auto& writer, const auto& message, const auto& condition) {
    if (!eventually([&] { return writer.matched(); })) return false;
    return eventually([&] {
      writer.write(message);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      look();
      return condition();
    });
  };
  char frame[] = "world";
  {
    Writer<quadrotor_msgs_msg_dds__PositionCommand_> writer(
        peer, "rt/drone0/cmd/position", quadrotor_msgs_msg_dds__PositionCommand__desc, reliable);
    quadrotor_msgs_msg_dds__PositionCommand_ m{};
    m.header.frame_id = frame;
    m.position = {start.x(), start.y(), start.z() + 0.1};
    EXPECT_TRUE(obeys(writer, m, [&] { return std::abs(p.z() - m.position.z) < 0.03; })) << p.z();
  }
  {
    Writer<mars_quadrotor_msgs_msg_dds__PositionCommand_> writer(
        peer,
        "rt/drone0/cmd/position_mars",
        mars_quadrotor_msgs_msg_dds__PositionCommand__desc,
        reliable);
    mars_quadrotor_msgs_msg_dds__PositionCommand_ m{};
    m.header.frame_id = frame;
    m.position = {start.x(), start.y(), start.z() + 0.4};
    EXPECT_TRUE(obeys(writer, m, [&] { return std::abs(p.z() - m.position.z) < 0.03; })) << p.z();
  }
  {
    Writer<geometry_msgs_msg_dds__PoseStamped_> writer(
        peer, "rt/drone0/goal", geometry_msgs_msg_dds__PoseStamped__desc, reliable);
    geometry_msgs_msg_dds__PoseStamped_ m{};
    m.header.frame_id = frame;
    m.pose.position = {start.x(), start.y(), start.z()};
    m.pose.orientation.w = 1.0;
    ASSERT_TRUE(eventually([&] { return writer.matched(); }));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    writer.write(m);
    EXPECT_TRUE(eventually([&] {
      look();
      return std::abs(p.z() - start.z()) < 0.03;
    }));
  }
  {
    Writer<geometry_msgs_msg_dds__TwistStamped_> writer(
        peer, "rt/drone0/cmd/velocity", geometry_msgs_msg_dds__TwistStamped__desc, reliable);
    geometry_msgs_msg_dds__TwistStamped_ m{};
    m.header.frame_id = frame;
    m.twist.linear.z = 0.5;
    EXPECT_TRUE(obeys(writer, m, [&] { return p.z() > start.z() + 0.5; }));
  }
  {
    Writer<sensor_msgs_msg_dds__Joy_> writer(
        peer, "rt/drone0/joy", sensor_msgs_msg_dds__Joy__desc, reliable);
    float axes[5] = {0.0f, -0.5f, 0.0f, 0.0f, 0.0f};
    sensor_msgs_msg_dds__Joy_ m{};
    m.header.frame_id = frame;
    m.axes = {5, 5, axes, false};
    EXPECT_TRUE(obeys(writer, m, [&] { return p.z() < start.z() + 0.1; }));
  }
  {
    Writer<mavros_msgs_msg_dds__AttitudeTarget_> writer(
        peer, "rt/drone0/cmd/attitude", mavros_msgs_msg_dds__AttitudeTarget__desc, reliable);
    mavros_msgs_msg_dds__AttitudeTarget_ m{};
    m.header.frame_id = frame;
    m.orientation.w = 1.0;
    m.thrust = 1.0f;  // all there is
    EXPECT_TRUE(obeys(writer, m, [&] { return v.z() > 1.0; }));
  }
  {
    Writer<quadrotor_msgs_msg_dds__TakeoffLand_> writer(
        peer, "rt/drone0/cmd/takeoff_land", quadrotor_msgs_msg_dds__TakeoffLand__desc, reliable);
    EXPECT_TRUE(obeys(writer, quadrotor_msgs_msg_dds__TakeoffLand_{2}, [&] {
      return p.z() < start.z() - 0.2 && v.norm() < 0.02;  // it stands on the ground
    })) << p.z();
    const double ground = p.z();
    EXPECT_TRUE(obeys(writer, quadrotor_msgs_msg_dds__TakeoffLand_{1}, [&] {
      return p.z() > ground + 0.5;
    })) << p.z();
  }
  {
    Writer<std_msgs_msg_dds__Float32MultiArray_> writer(
        peer, "rt/drone0/cmd/rotors", std_msgs_msg_dds__Float32MultiArray__desc, reliable);
    float speeds[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    std_msgs_msg_dds__Float32MultiArray_ m{};
    m.data = {4, 4, speeds, false};
    EXPECT_TRUE(obeys(writer, m, [&] { return v.z() < -0.3; }));
  }
}

TEST_P(Ros2Inputs, PauseStepAndReset) {
  const bool reliable = GetParam();
  const auto flight = fly();
  Peer peer;
  Reader<rosgraph_msgs_msg_dds__Clock_> clock(
      peer, "rt/clock", rosgraph_msgs_msg_dds__Clock__desc, true);
  Writer<std_msgs_msg_dds__Bool_> pause(
      peer, "rt/pointflight/pause", std_msgs_msg_dds__Bool__desc, reliable);
  Writer<std_msgs_msg_dds__Empty_> step(
      peer, "rt/pointflight/step", std_msgs_msg_dds__Empty__desc, reliable);
  Writer<std_msgs_msg_dds__Empty_> reset(
      peer, "rt/pointflight/reset", std_msgs_msg_dds__Empty__desc, reliable);
  double now = -1.0;
  bool back = false;
  const auto look = [&] {
    return clock.take([&](const auto& m) {
      const double t = m.clock.sec - 1.7e9 + 1e-9 * m.clock.nanosec;
      back = back || t < now;
      now = t;
    });
  };
  ASSERT_TRUE(eventually([&] {
    look();
    return now > 0.5 && pause.matched() && step.matched() && reset.matched();
  })) << flight->stop();
  pause.write({true});
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  look();
  const double still = now;
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_GT(look(), 2);  // it goes on saying what time it is
  EXPECT_EQ(now, still);
  step.write({0});
  EXPECT_TRUE(eventually([&] {
    look();
    return now > still;
  }));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  look();
  EXPECT_LT(now, still + 0.15);  // to the next scan, and no further
  pause.write({false});
  EXPECT_TRUE(eventually([&] {
    look();
    return now > still + 0.4;
  }));
  reset.write({0});
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  look();
  EXPECT_FALSE(back);  // stamps go on
  testing::expect_contains(flight->stop(), "reset: at the start again");
}

TEST_F(Ros2, WrongTypesNumbersAndSizesChangeNothing) {
  const auto flight = fly();
  Peer peer;
  Reader<nav_msgs_msg_dds__Odometry_> odometry(
      peer, "rt/drone0/odom", nav_msgs_msg_dds__Odometry__desc, true);
  Vector3d p = Vector3d::Zero();
  int seen = 0;
  const auto look = [&] {
    return odometry.take([&](const auto& m) {
      p = {m.pose.pose.position.x, m.pose.pose.position.y, m.pose.pose.position.z};
      ++seen;
    });
  };
  ASSERT_TRUE(eventually([&] { return look() > 0; })) << flight->stop();
  const Vector3d start = p;
  char text[] = "to the left, please";
  char frame[] = "world";
  Writer<std_msgs_msg_dds__String_> string(
      peer, "rt/drone0/goal", std_msgs_msg_dds__String__desc, true);
  string.write({text});  // of no type that is read there
  Writer<geometry_msgs_msg_dds__TwistStamped_> twist(
      peer, "rt/drone0/cmd/velocity", geometry_msgs_msg_dds__TwistStamped__desc, true);
  Writer<std_msgs_msg_dds__Float32MultiArray_> rotors(
      peer, "rt/drone0/cmd/rotors", std_msgs_msg_dds__Float32MultiArray__desc, true);
  ASSERT_TRUE(eventually([&] { return twist.matched() && rotors.matched(); }));
  geometry_msgs_msg_dds__TwistStamped_ nan{};
  nan.header.frame_id = frame;
  nan.twist.linear.x = std::nan("");
  std::vector<float> speeds(5'000'000, 1.0f);  // 20 MB
  std_msgs_msg_dds__Float32MultiArray_ large{};
  large.data = {5'000'000, 5'000'000, speeds.data(), false};
  for (int i = 0; i < 10; ++i) {
    twist.write(nan);
    if (i < 2) rotors.write(large);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  seen = 0;
  EXPECT_TRUE(eventually([&] {
    look();
    return seen > 200;
  }));
  EXPECT_LT((p - start).norm(), 0.05);
  const std::string said = flight->stop();
  testing::expect_contains(said, "not finite");
  testing::expect_contains(said, "interrupted");
}

}  // namespace
}  // namespace pointflight
