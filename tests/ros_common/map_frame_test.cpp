// Clouds of maps far from zero: in a frame of their own, as exact as near zero.
#include "pointflight/ros/common/map_frame.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "pointflight/map/edit/map_edit.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/ros/common/inputs.hpp"
#include "tests/ros_common/keeper.hpp"
#include "tests/sim/runs.hpp"

namespace pointflight {
namespace {

using testing::expect_contains;
using testing::hall;
using testing::Keeper;

const Vector3d kUtm(836'410.0, 4'818'050.0, 300.0);

Aabb box(const Vector3d& min, const Vector3d& max) {
  Aabb bounds;
  bounds.add(min);
  bounds.add(max);
  return bounds;
}

std::shared_ptr<const SurfelMap> far_hall() {
  EditedMap edited = transform_map(*hall(), {Quaterniond::Identity(), kUtm}, {}, Executor(1));
  return SurfelMap::from_bytes(map_bytes(edited.tree, edited.description), "far");
}

Scenario far_flight() {
  Scenario s = testing::hovering();
  s.duration = 0.3;
  s.vehicles[0].start += kUtm;
  s.vehicles[0].lidars = {LidarMount{}};
  s.vehicles[0].lidars[0].noise = false;
  ObstacleSettings ball = testing::passing(1.0);
  for (Vector3d& p : ball.waypoints) p += kUtm;
  s.obstacles.push_back(ball);
  return s;
}

Keeper flown(const RosProfile& profile) {
  return testing::kept(far_flight(), far_hall(), profile);
}

std::vector<Vector3d> points_of_message(const msg::PointCloud2& cloud) {
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < cloud.width; ++i) {
    Vector3f p;
    std::memcpy(p.data(), cloud.data.data() + i * cloud.point_step, sizeof(float) * 3);
    points.push_back(p.cast<double>());
  }
  return points;
}

TEST(MapFrame, IsUsedOnlyFarFromZero) {
  const RosProfile profile = load_ros_profile("default");
  EXPECT_FALSE(map_frame_for({}, profile).is_used());
  EXPECT_FALSE(map_frame_for(box({-8000, -8000, 0}, {8000, 8000, 50}), profile).is_used());
  const Aabb utm = box(kUtm, kUtm + Vector3d(40, 24, 6));
  const MapFrame far = map_frame_for(utm, profile);
  EXPECT_EQ(far.name, "map");
  // whole hundreds of metres, and no height of its own where that is near
  EXPECT_EQ(far.origin, Vector3d(836'400, 4'818'100, 0));
  EXPECT_EQ(far.step, 0.5);
  expect_contains(note_of(far, profile, "utm.pfmap").value(),
                  "map transform utm.pfmap -o near.pfmap --origin 836400,4818100,0");
  EXPECT_FALSE(note_of({}, profile, "near.pfmap"));
  // FUEL's sensor poses are in a frame that it calls map
  EXPECT_EQ(map_frame_for(utm, load_ros_profile("fuel")).name, "map_origin");
}

TEST(MapFrame, CloudsOfAFarMapAreAsExactAsNearZero) {
  const Keeper keeper = flown(load_ros_profile("default"));
  const auto fixed = keeper.of<msg::TFMessage>("/tf_static");
  ASSERT_EQ(fixed.size(), 1u);
  Vector3d origin = Vector3d::Zero();
  int frames = 0;
  for (const msg::TransformStamped& t : fixed[0].transforms) {
    if (t.child_frame_id != "map") continue;
    ++frames;
    EXPECT_EQ(t.header.frame_id, "world");
    EXPECT_EQ(t.transform.rotation.w, 1.0);
    origin = {t.transform.translation.x, t.transform.translation.y, t.transform.translation.z};
  }
  EXPECT_EQ(frames, 1);
  const auto map = far_hall();
  const auto expect_on_map = [&](const std::string& topic, double within) {
    const auto clouds = keeper.of<msg::PointCloud2>(topic);
    ASSERT_FALSE(clouds.empty()) << topic;
    EXPECT_EQ(clouds.back().header.frame_id, "map") << topic;
    int off = 0;
    const auto points = points_of_message(clouds.back());
    for (const Vector3d& p : points) off += map->nearest(p + origin, within) ? 0 : 1;
    EXPECT_LT(off, static_cast<int>(points.size() / 50)) << topic;  // the ball
  };
  expect_on_map("/map", 1e-3);
  expect_on_map("/drone0/mid360/points_world", 0.03);
  // poses are doubles
  const auto odometry = keeper.of<msg::Odometry>("/drone0/odom");
  EXPECT_EQ(odometry.front().header.frame_id, "world");
  EXPECT_NEAR(odometry.front().pose.pose.position.y, kUtm.y() + 6.0, 0.01);
}

TEST(MapFrame, AFrameThatTheProfileNamesHasATransform) {
  RosProfile profile = load_ros_profile("default");
  for (RosOutput& output : profile.outputs) {
    if (output.kind == "map") output.frame = "site";
    if (output.kind == "cloud_world") output.frame = "world";
  }
  const Keeper keeper = flown(profile);
  std::set<std::string> children;
  const auto fixed = keeper.of<msg::TFMessage>("/tf_static");
  for (const msg::TransformStamped& t : fixed.at(0).transforms) {
    if (t.header.frame_id == "world") children.insert(t.child_frame_id);
  }
  EXPECT_EQ(children, (std::set<std::string>{"map", "site"}));
  EXPECT_EQ(keeper.of<msg::PointCloud2>("/map").at(0).header.frame_id, "site");
  EXPECT_EQ(keeper.of<msg::PointCloud2>("/drone0/mid360/points_world").at(0).header.frame_id,
            "map");
}

TEST(MapFrame, GoalsAndCommandsMayBeInIt) {
  OrderContext context;
  context.world_frame = "world";
  context.map_frame = {"map", kUtm, 0.5};
  const auto command_for = [&](const std::string& kind, const auto& message) {
    std::string reason;
    const auto orders = testing::orders_for(kind, message, context, reason);
    EXPECT_EQ(reason, "");
    return std::get<VehicleOrder>(orders.at(0)).command;
  };
  msg::PoseStamped goal;
  goal.pose.position = {1, 2, 3};
  goal.pose.orientation.w = 1.0;
  msg::PositionCommandShort position;
  position.position = {1, 2, 3};
  for (const char* frame : {"map", "world"}) {
    goal.header.frame_id = position.header.frame_id = frame;
    const Vector3d expected =
        Vector3d(1, 2, 3) + (frame == std::string("map") ? kUtm : Vector3d(0, 0, 0));
    EXPECT_EQ(std::get<WaypointCommand>(command_for("goal", goal)).mission.waypoints.at(0),
              expected);
    EXPECT_EQ(std::get<PositionCommand>(command_for("position", position)).p_world, expected);
  }
  msg::TwistStamped velocity;
  velocity.header.frame_id = "map";
  EXPECT_FALSE(std::get<VelocityCommand>(command_for("velocity", velocity)).in_body);
}

}  // namespace
}  // namespace pointflight
