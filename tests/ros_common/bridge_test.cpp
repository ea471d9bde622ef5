// A run's messages as an outlet gets them: which, how often, in which frame, with which numbers.
#include "pointflight/ros/common/bridge.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "pointflight/core/hash.hpp"
#include "pointflight/ros/common/conversion.hpp"
#include "pointflight/ros/common/scan_messages.hpp"
#include "tests/ros_common/keeper.hpp"
#include "tests/sim/runs.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::hall;
using testing::Keeper;

constexpr Duration kEpoch = std::chrono::seconds(1'700'000'000);

/// A flight of a second along x with a Mid-360.
Scenario flight(double duration = 1.0) {
  Scenario s = testing::hovering();
  s.duration = duration;
  s.vehicles[0].lidars = {LidarMount{}};
  s.vehicles[0].mission.waypoints = {{14, 6, 3}};
  s.vehicles[0].start_yaw_deg = 90.0;
  s.vehicles[0].mission.yaw = YawMode::kFixed;
  return s;
}

void fly(const Scenario& scenario, const RosProfile& profile, Outlet& outlet, int threads = 2) {
  const Executor executor(threads);
  Simulation simulation(scenario, hall(), executor);
  RosBridge bridge(describe_run(simulation), profile, kEpoch);
  bridge.add(outlet);
  bridge.start();
  while (simulation.step(bridge)) bridge.on_time(simulation.time());
  bridge.on_time(simulation.time());
}

double seconds_of(const msg::Time& t) {
  return t.sec - 1'700'000'000 + 1e-9 * t.nanosec;
}

/// With an IMU whose errors do not hide its axes and units.
Scenario plain_flight(const testing::TemporaryFolder& folder) {
  Scenario scenario = flight();
  scenario.vehicles[0].model =
      testing::changed_vehicle(folder, "quad_330", "part: icm40609", "gyro_noise_density: 6.63e-5");
  return scenario;
}

TEST(RosBridge, SendsTheDefaultProfile) {
  const testing::TemporaryFolder folder;
  Keeper keeper;
  fly(plain_flight(folder), load_ros_profile("default"), keeper);
  const auto odometry = keeper.of<msg::Odometry>("/drone0/odom");
  ASSERT_EQ(odometry.size(), 201u);
  EXPECT_EQ(odometry[0].header.frame_id, "world");
  EXPECT_EQ(odometry[0].child_frame_id, "drone0/base_link");
  EXPECT_NEAR(seconds_of(odometry[77].header.stamp), 0.385, 1e-9);
  // it flies along the world's x and looks along y: to its right
  EXPECT_GT(odometry.back().twist.twist.linear.y, -10.0);
  EXPECT_LT(odometry.back().twist.twist.linear.y, -0.3);
  EXPECT_NEAR(odometry.back().twist.twist.linear.x, 0.0, 0.05);

  const auto imu = keeper.of<msg::Imu>("/drone0/imu");
  ASSERT_EQ(imu.size(), 201u);
  EXPECT_NEAR(imu[0].linear_acceleration.z, 9.81, 0.3);
  EXPECT_GT(imu[0].angular_velocity_covariance[0], 0.0);

  const auto clouds = keeper.of<msg::PointCloud2>("/drone0/mid360/points");
  ASSERT_EQ(clouds.size(), 10u);
  EXPECT_EQ(clouds[0].header.frame_id, "drone0/mid360");
  EXPECT_EQ(clouds[0].point_step, 26u);
  EXPECT_GT(clouds[0].width, 10000u);

  EXPECT_EQ(keeper.of<msg::Clock>("/clock").size(), 101u);
  EXPECT_EQ(keeper.of<msg::TFMessage>("/tf").size(), 101u);
  const auto fixed = keeper.of<msg::TFMessage>("/tf_static");
  ASSERT_EQ(fixed.size(), 1u);
  ASSERT_EQ(fixed[0].transforms.size(), 1u);
  EXPECT_EQ(fixed[0].transforms[0].header.frame_id, "drone0/base_link");
  EXPECT_EQ(fixed[0].transforms[0].child_frame_id, "drone0/mid360");
  EXPECT_EQ(fixed[0].transforms[0].transform.translation.z, 0.1);
  const auto map = keeper.of<msg::PointCloud2>("/map");
  ASSERT_EQ(map.size(), 1u);
  EXPECT_GT(map[0].width, 10000u);
  EXPECT_EQ(keeper.of<msg::DiagnosticArray>("/diagnostics").size(), 2u);
  EXPECT_EQ(keeper.of<msg::Path>("/drone0/path").size(), 6u);
}

TEST(RosBridge, ImuSamplesThatCoverAScanComeBeforeIt) {
  Keeper keeper;
  fly(flight(), load_ros_profile("default"), keeper);
  double imu_until = 0.0;
  int scans = 0;
  for (const auto& s : keeper.sent) {
    const Topic& topic = keeper.topics[static_cast<std::size_t>(s.topic)];
    if (topic.name == "/drone0/imu") {
      imu_until = seconds_of(decode<Wire::kCdr, msg::Imu>(*s.bytes)->header.stamp);
    } else if (topic.name == "/drone0/mid360/points") {
      EXPECT_GE(imu_until + 1e-9, 0.1 * ++scans);
    }
  }
  EXPECT_EQ(scans, 10);
}

class WorldClouds : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Snapshot, WorldClouds, ::testing::Bool());

TEST_P(WorldClouds, LieOnTheMap) {
  Keeper keeper;
  Scenario scenario = flight();
  scenario.vehicles[0].lidars[0].noise = false;
  scenario.vehicles[0].lidars[0].snapshot = GetParam();
  scenario.vehicles[0].mission.motion = {6.0, 8.0, 40.0};  // fast enough to show
  fly(scenario, load_ros_profile("default"), keeper);
  const auto clouds = keeper.of<msg::PointCloud2>("/drone0/mid360/points_world");
  ASSERT_EQ(clouds.size(), 10u);
  const msg::PointCloud2& cloud = clouds.back();  // taken in motion
  EXPECT_EQ(cloud.header.frame_id, "world");
  for (std::size_t i = 0; i < cloud.width; i += 97) {
    std::array<float, 3> p{};
    std::memcpy(p.data(), cloud.data.data() + i * cloud.point_step, sizeof p);
    EXPECT_TRUE(hall()->nearest(Vector3f(p[0], p[1], p[2]).cast<double>(), 0.05)) << i;
  }
}

TEST(RosBridge, BothWiresSayTheSame) {
  Keeper cdr(Wire::kCdr);
  Keeper ros1(Wire::kRos1);
  const Executor executor(2);
  Simulation simulation(flight(0.5), hall(), executor);
  RosBridge bridge(describe_run(simulation), load_ros_profile("default"), kEpoch);
  bridge.add(cdr);
  bridge.add(ros1);
  bridge.start();
  while (simulation.step(bridge)) bridge.on_time(simulation.time());
  ASSERT_EQ(cdr.sent.size(), ros1.sent.size());
  const auto a = cdr.of<msg::Odometry>("/drone0/odom");
  const auto b = ros1.of<msg::Odometry>("/drone0/odom");
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].pose.pose.position.x, b[i].pose.pose.position.x);
    EXPECT_EQ(a[i].header.stamp, b[i].header.stamp);
    EXPECT_EQ(b[i].header.seq, i);
  }
}

TEST(RosBridge, Threads_TheSameBytesDoesNotDependOnThreads) {
  std::uint64_t first = 0;
  for (const int threads : {1, 2, 8}) {
    Keeper keeper;
    fly(flight(0.4), load_ros_profile("default"), keeper, threads);
    const std::uint64_t hash = hash64(keeper.all);
    if (threads == 1) first = hash;
    EXPECT_EQ(hash, first);
  }
}

/// What the table of INTEROP for MARSIM's branch ubuntu20 says.
TEST(RosBridge, MarsimsGraph) {
  Keeper keeper(Wire::kRos1);
  Scenario scenario = flight();
  scenario.vehicles[0].copies = 2;
  scenario.obstacles = {testing::passing(1.0)};
  fly(scenario, load_ros_profile("marsim"), keeper);
  const struct {
    const char* topic;
    const char* type;
    const char* md5;
    const char* frame;
    std::size_t messages;  ///< In a second.
  } expected[] = {
      {"/quad_0/lidar_slam/odom",
       "nav_msgs/Odometry",
       "cd5e73d190d741a2f92e81eda573aca7",
       "world",
       201},
      {"/quad_1/imu", "sensor_msgs/Imu", "6a62c6daae103f4ff57a132d6f95cec2", "quad_1", 201},
      {"/quad0_pcl_render_node/cloud",
       "sensor_msgs/PointCloud2",
       "1158d486dd51d683ce2f1be655c3c181",
       "world",
       10},
      {"/quad0_pcl_render_node/sensor_cloud",
       "sensor_msgs/PointCloud2",
       "1158d486dd51d683ce2f1be655c3c181",
       "sensor",
       10},
      {"/quad0_pcl_render_node/sensor_pose",
       "geometry_msgs/PoseStamped",
       "d3812c3cbc69362b77dc0b19b345f8f5",
       "map",
       10},
      {"/quad0_pcl_render_node/depth_img",
       "sensor_msgs/Image",
       "060021388200f6f0f447d0fcd9c64743",
       "sensor",
       10},
      {"/quad0_pcl_render_node/dyn_cloud",
       "sensor_msgs/PointCloud2",
       "1158d486dd51d683ce2f1be655c3c181",
       "world",
       11},
      {"/quad0_pcl_render_node/uav_cloud",
       "sensor_msgs/PointCloud2",
       "1158d486dd51d683ce2f1be655c3c181",
       "world",
       201},
      {"/map_generator/global_cloud",
       "sensor_msgs/PointCloud2",
       "1158d486dd51d683ce2f1be655c3c181",
       "world",
       1},
      {"/quad0_odom_visualization/robot",
       "visualization_msgs/Marker",
       "4048c9de2a16f4ae8e0538085ebf1b97",
       "world",
       201},
  };
  for (const auto& e : expected) {
    std::size_t messages = 0;
    std::string frame;
    const Topic* topic = nullptr;
    for (const auto& s : keeper.sent) {
      const Topic& t = keeper.topics[static_cast<std::size_t>(s.topic)];
      if (t.name != e.topic) continue;
      topic = &t;
      ++messages;
      // header first: seq, stamp, frame
      std::uint32_t size = 0;
      std::memcpy(&size, s.bytes->data() + 12, 4);
      frame.assign(reinterpret_cast<const char*>(s.bytes->data() + 16), size);
    }
    ASSERT_NE(topic, nullptr) << e.topic;
    EXPECT_EQ(topic->type.ros1_name(), e.type) << e.topic;
    EXPECT_EQ(topic->type.md5, e.md5) << e.topic;
    EXPECT_EQ(frame, e.frame) << e.topic;
    EXPECT_NEAR(static_cast<double>(messages), static_cast<double>(e.messages), 1.0) << e.topic;
  }
  // velocities in the world
  const auto odometry = keeper.of<msg::Odometry>("/quad_0/lidar_slam/odom");
  EXPECT_GT(odometry.back().twist.twist.linear.x, 0.3);
  EXPECT_EQ(odometry[0].child_frame_id, "");
  // the map's points as MARSIM packs them, clouds as well
  const auto map = keeper.of<msg::PointCloud2>("/map_generator/global_cloud");
  EXPECT_EQ(map[0].point_step, 16u);
  EXPECT_EQ(map[0].point_fields.size(), 3u);
  const auto cloud = keeper.of<msg::PointCloud2>("/quad0_pcl_render_node/cloud");
  EXPECT_EQ(cloud[0].point_step, 32u);
  EXPECT_EQ(cloud[0].point_fields[3].offset, 16u);
}

/// tf2 knows one parent and one place of each frame.
TEST(RosBridge, Slow_SeveralVehiclesShareNoFrame) {
  Scenario scenario = flight(0.3);
  scenario.vehicles[0].lidars.push_back(LidarMount{"d455"});
  scenario.vehicles.push_back(scenario.vehicles[0]);
  scenario.vehicles[1].name = "drone1";
  scenario.vehicles[1].start = {12, 3, 3};
  scenario.vehicles[1].mission.waypoints = {};
  Keeper marsim;
  fly(scenario, load_ros_profile("marsim"), marsim);
  const auto frames = [&](const Keeper& keeper, const std::string& topic) {
    std::set<std::string> names;
    for (const auto& m : keeper.of<msg::TFMessage>(topic)) {
      for (const auto& transform : m.transforms) names.insert(transform.child_frame_id);
    }
    return names;
  };
  EXPECT_EQ(frames(marsim, "/tf"), (std::set<std::string>{"sensor", "drone1/sensor"}));
  const auto clouds = marsim.of<msg::PointCloud2>("/quad1_pcl_render_node/sensor_cloud");
  ASSERT_FALSE(clouds.empty());
  EXPECT_EQ(clouds[0].header.frame_id, "drone1/sensor");
  RosProfile profile = load_ros_profile("livox");
  for (const char* kind : {"tf", "tf_static"}) {
    profile.outputs.emplace_back();
    profile.outputs.back().kind = kind;
    profile.outputs.back().topic = std::string("/") + kind;
  }
  Keeper livox;
  fly(scenario, profile, livox);
  EXPECT_EQ(frames(livox, "/tf"), (std::set<std::string>{"base_link", "drone1/base_link"}));
  const auto fixed = livox.of<msg::TFMessage>("/tf_static");
  ASSERT_EQ(fixed.size(), 1u);
  EXPECT_EQ(frames(livox, "/tf_static"),
            (std::set<std::string>{"livox_frame",
                                   "livox_frame_d455",
                                   "livox_frame_d455_optical",
                                   "drone1/livox_frame",
                                   "drone1/livox_frame_d455",
                                   "drone1/livox_frame_d455_optical"}));
}

TEST(RosProfiles, AnyCanSendTheClock) {
  EXPECT_TRUE(has_clock(load_ros_profile("default")));
  RosProfile ego = load_ros_profile("ego");
  EXPECT_FALSE(has_clock(ego));
  const std::size_t outputs = ego.outputs.size();
  add_clock(ego);
  add_clock(ego);
  EXPECT_TRUE(has_clock(ego));
  EXPECT_EQ(ego.outputs.size(), outputs + 1);
  ego.outputs.front().topic = "-";  // switched off
  EXPECT_FALSE(has_clock(ego));
  add_clock(ego);
  EXPECT_TRUE(has_clock(ego));
  EXPECT_EQ(ego.outputs.size(), outputs + 1);
}

TEST(RosBridge, TheClockOfAPausedRunSaysWhereItStands) {
  const Executor executor(1);
  Simulation simulation(flight(), hall(), executor);
  RosBridge bridge(describe_run(simulation), load_ros_profile("default"), kEpoch);
  Keeper keeper;
  bridge.add(keeper);
  bridge.start();
  for (int i = 0; i < 13; ++i) {  // a step of the physics is a millisecond
    simulation.step(bridge);
    bridge.on_time(simulation.time());
  }
  EXPECT_NEAR(seconds_of(keeper.of<msg::Clock>("/clock").back().clock), 0.010, 1e-9);
  bridge.on_wait(simulation.time());
  EXPECT_NEAR(seconds_of(keeper.of<msg::Clock>("/clock").back().clock), 0.013, 1e-9);
}

TEST(ScanMessages, PointsThatAHullTouchesLieAroundIt) {
  const auto map = hall();
  const Solid hull{Sphere{0.3}};
  Pose pose;
  pose.translation = {6, 6, 3};
  EXPECT_TRUE(touched_points(*map, hull, pose, Vector3d::Zero()).empty());
  pose.translation.z() = 0.1;  // in the floor
  const auto points = touched_points(*map, hull, pose, Vector3d::Zero());
  EXPECT_GT(points.size(), 3u);
  for (const Vector3f& p : points) {
    EXPECT_LT((p.cast<double>() - pose.translation).norm(), 0.3 + 2.0 * map->resolution());
  }
}

TEST(RosBridge, SettingsOfAProfile) {
  RosProfile profile = parse_ros_profile(
      "imu_unit: g\nimu_gravity: down\noutputs:\n  - {kind: imu, topic: /imu, rate: 50}\n"
      "  - {kind: cloud, topic: /livox/lidar, layout: livox_custom, rate: 5}\n",
      "p.yaml");
  const testing::TemporaryFolder folder;
  Keeper keeper;
  fly(plain_flight(folder), profile, keeper);
  const auto imu = keeper.of<msg::Imu>("/imu");
  ASSERT_EQ(imu.size(), 51u);
  EXPECT_NEAR(imu[0].linear_acceleration.z, -1.0, 0.03);
  const auto clouds = keeper.of<msg::CustomMsg>("/livox/lidar");
  ASSERT_EQ(clouds.size(), 5u);
  EXPECT_GT(clouds[0].point_num, 10000u);
  // one name for two kinds of message
  profile.outputs[1].topic = "/imu";
  const Executor executor(1);
  const Simulation simulation(flight(), hall(), executor);
  expect_contains(error_of([&] { RosBridge(describe_run(simulation), profile, kEpoch); }),
                  "/imu would carry");
}

}  // namespace
}  // namespace pointflight
