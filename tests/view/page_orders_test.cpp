#include "pointflight/view/page_orders.hpp"

#include <gtest/gtest.h>

#include "tests/support.hpp"

namespace pointflight {
namespace {

TEST(PageOrders, AreReadOrSaidWhatIsWrongWithThem) {
  MotionLimits slow;
  slow.speed = 0.5;
  const std::vector<MotionLimits> motions = {MotionLimits{}, slow};
  const auto order = [&](const char* text) { return page_order(text, motions); };
  const auto goal = std::get<VehicleOrder>(order(R"({"vehicle":1,"goal":[1,2.5,3]})"));
  EXPECT_EQ(goal.vehicle, 1u);
  const auto& waypoint = std::get<WaypointCommand>(goal.command);
  EXPECT_EQ(waypoint.mission.waypoints.at(0), Vector3d(1, 2.5, 3));
  EXPECT_EQ(waypoint.mission.motion.speed, 0.5);
  const auto velocity =
      std::get<VehicleOrder>(order(R"({"vehicle":0,"velocity":[1,0,0],"yaw_rate":-1})"));
  EXPECT_TRUE(std::get<VelocityCommand>(velocity.command).in_body);
  EXPECT_EQ(std::get<VelocityCommand>(velocity.command).yaw_rate, -1.0);
  EXPECT_TRUE(std::get<PauseOrder>(order(R"({"pause":true})")).pause);
  EXPECT_FALSE(std::get<PauseOrder>(order(R"({"pause":false})")).pause);
  EXPECT_TRUE(std::holds_alternative<StepOrder>(order(R"({"step":true})")));
  EXPECT_TRUE(std::holds_alternative<ResetOrder>(order(R"({"reset":true})")));
  EXPECT_EQ(std::get<RateOrder>(order(R"({"rate":0.1})")).rate, 0.1);
  EXPECT_EQ(std::get<SeekOrder>(order(R"({"seek":2.5})")).to, SimTime(from_seconds(2.5)));
  for (const char* wrong : {"",
                            "[]",
                            "{}",
                            R"({"vehicle":2,"hover":true})",
                            R"({"vehicle":-1,"hover":true})",
                            R"({"vehicle":0,"goal":[1,2]})",
                            R"({"vehicle":0,"goal":[1,2,1e9]})",
                            R"({"vehicle":0,"goal":[1,2,"x"]})",
                            R"({"vehicle":0,"velocity":[1,2,null]})",
                            R"({"pause":1})",
                            R"({"rate":-1})",
                            R"({"rate":1e9})"}) {
    EXPECT_FALSE(testing::error_of([&] { static_cast<void>(order(wrong)); }).empty()) << wrong;
  }
}

}  // namespace
}  // namespace pointflight
