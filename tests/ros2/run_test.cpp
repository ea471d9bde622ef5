// How a run beside ROS 2 begins, is steered and ends: services, frames, stamps, lockstep, missions.
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <random>
#include <thread>
#include <vector>

#include "tests/ros2/fixture.hpp"

namespace pointflight {
namespace {

using testing::eventually;
using testing::expect_contains;
using testing::Flight;
using testing::Peer;
using testing::read_file;
using testing::Reader;
using testing::Ros2;
using testing::write_file;
using testing::Writer;

double seconds_of(const builtin_interfaces_msg_dds__Time_& stamp) {
  return stamp.sec + 1e-9 * stamp.nanosec;
}

/// A client of a service, as rmw_cyclonedds makes them.
template <class Request, class Response>
class Client {
 public:
  Client(Peer& peer,
         const std::string& name,
         const dds_topic_descriptor_t& request,
         const dds_topic_descriptor_t& response)
      : reader_(peer, "rr" + name + "Reply", response, true),
        writer_(peer, "rq" + name + "Request", request, true) {}

  bool matched() const { return writer_.matched(); }

  /// Asks, and waits for the answer to this question.
  bool call(Request request) {
    request.client = kClient;
    request.number = ++number_;
    writer_.write(request);
    bool success = false;
    return eventually([&] {
             bool answered = false;
             reader_.take([&](const Response& response) {
               if (response.client != kClient || response.number != number_) return;
               answered = true;
               success = response.success;
             });
             return answered;
           }) &&
           success;
  }

 private:
  static constexpr std::uint64_t kClient = 0x0123456789abcdef;
  Reader<Response> reader_;
  Writer<Request> writer_;
  std::int64_t number_ = 0;
};

TEST_F(Ros2, ServicesPauseStepAndReset) {
  const auto flight = fly();
  Peer peer;
  Reader<rosgraph_msgs_msg_dds__Clock_> clock(
      peer, "rt/clock", rosgraph_msgs_msg_dds__Clock__desc, true);
  using Trigger = Client<std_srvs_srv_dds__Trigger_Request_, std_srvs_srv_dds__Trigger_Response_>;
  Client<std_srvs_srv_dds__SetBool_Request_, std_srvs_srv_dds__SetBool_Response_> pause(
      peer,
      "/pointflight/pause",
      std_srvs_srv_dds__SetBool_Request__desc,
      std_srvs_srv_dds__SetBool_Response__desc);
  Trigger step(peer,
               "/pointflight/step",
               std_srvs_srv_dds__Trigger_Request__desc,
               std_srvs_srv_dds__Trigger_Response__desc);
  Trigger reset(peer,
                "/pointflight/reset",
                std_srvs_srv_dds__Trigger_Request__desc,
                std_srvs_srv_dds__Trigger_Response__desc);
  double now = -1.0;
  const auto look = [&] { clock.take([&](const auto& m) { now = seconds_of(m.clock) - 1.7e9; }); };
  ASSERT_TRUE(eventually([&] {
    look();
    return now > 0.3 && pause.matched() && step.matched() && reset.matched();
  })) << flight->stop();
  EXPECT_TRUE(pause.call({0, 0, true}));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  look();
  const double still = now;
  EXPECT_TRUE(step.call({}));
  EXPECT_TRUE(eventually([&] {
    look();
    return now > still;
  }));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  look();
  EXPECT_LT(now, still + 0.15);
  EXPECT_TRUE(pause.call({0, 0, false}));
  EXPECT_TRUE(eventually([&] {
    look();
    return now > still + 0.3;
  }));
  EXPECT_TRUE(reset.call({}));
  EXPECT_TRUE(eventually([&] {
    return read_file(*folder_ / "fly.log").find("reset: at the start") != std::string::npos;
  }));
}

/// A goal in a frame that is not the world's is refused, and it is said where one would look.
TEST_F(Ros2, AGoalInAnUnknownFrameIsRefused) {
  for (const bool alias : {false, true}) {
    const auto flight =
        fly("", hovering_with({"mid360"}, map(), alias ? "ros: {world_alias: map}\n" : ""));
    Peer peer;
    Reader<nav_msgs_msg_dds__Odometry_> odometry(
        peer, "rt/drone0/odom", nav_msgs_msg_dds__Odometry__desc, true);
    Reader<diagnostic_msgs_msg_dds__DiagnosticArray_> diagnostics(
        peer, "rt/diagnostics", diagnostic_msgs_msg_dds__DiagnosticArray__desc, true);
    Writer<geometry_msgs_msg_dds__PoseStamped_> goal(
        peer, "rt/drone0/goal", geometry_msgs_msg_dds__PoseStamped__desc, true);
    Vector3d p = Vector3d::Zero();
    int seen = 0;
    const auto look = [&] {
      return seen += odometry.take([&](const auto& m) {
        const auto& at = m.pose.pose.position;
        p = {at.x, at.y, at.z};
      });
    };
    ASSERT_TRUE(eventually([&] { return look() > 0 && goal.matched(); })) << flight->stop();
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    const Vector3d start = p;
    char frame[] = "map";
    geometry_msgs_msg_dds__PoseStamped_ m{};
    m.header.frame_id = frame;
    m.pose.position = {start.x(), start.y(), start.z() + 0.3};
    m.pose.orientation.w = 1.0;
    goal.write(m);
    if (alias) {
      EXPECT_TRUE(eventually([&] {
        look();
        return p.z() > start.z() + 0.27;
      })) << flight->stop();
      continue;
    }
    std::string told;
    EXPECT_TRUE(eventually([&] {
      diagnostics.take([&](const auto& array) {
        for (std::uint32_t i = 0; i < array.status._length; ++i) {
          const auto& values = array.status._buffer[i].values;
          for (std::uint32_t k = 0; k < values._length; ++k) {
            const auto& entry = values._buffer[k];
            if (std::string(entry.key) == "last_message_refused") told = entry.value;
          }
        }
      });
      return !told.empty();
    }));
    expect_contains(told, "frame 'map' is not known; it is 'world' here");
    look();
    EXPECT_LT((p - start).norm(), 0.05);
    expect_contains(flight->stop(), "warning: /drone0/goal: frame 'map' is not known");
  }
}

/// Nodes that live on see time go on when the simulator is started again.
TEST_F(Ros2, StampsAreOfTheWallClockWhenLive) {
  const auto flight = fly("--epoch now");  // as without: the fixture alone fixes it
  Flight plain({map(), "--ros2", "--ros2-localhost", "--node", "other"}, *folder_ / "plain.log");
  Peer peer;
  Reader<rosgraph_msgs_msg_dds__Clock_> clock(
      peer, "rt/clock", rosgraph_msgs_msg_dds__Clock__desc, true);
  int count = 0;
  EXPECT_TRUE(eventually([&] {
    return (count += clock.take([&](const auto& m) {
             EXPECT_NEAR(seconds_of(m.clock), static_cast<double>(std::time(nullptr)), 30.0);
           })) > 100;
  })) << plain.stop();
}

/// A planner that comes after the simulator gets the first scan, and all that follow.
TEST_F(Ros2, LockstepWaitsForAPlannerThatComesLate) {
  const auto flight = fly("--lockstep 20 --rate max", hovering_with({"mid360"}, map()));
  std::this_thread::sleep_for(std::chrono::seconds(2));
  Peer peer;
  Reader<sensor_msgs_msg_dds__PointCloud2_> cloud(
      peer, "rt/drone0/mid360/points", sensor_msgs_msg_dds__PointCloud2__desc, true);
  Writer<geometry_msgs_msg_dds__TwistStamped_> answer(
      peer, "rt/drone0/cmd/velocity", geometry_msgs_msg_dds__TwistStamped__desc, true);
  geometry_msgs_msg_dds__TwistStamped_ hover{};
  char frame[] = "world";
  hover.header.frame_id = frame;
  std::vector<double> stamps;
  EXPECT_TRUE(eventually(
      [&] {
        cloud.take([&](const auto& m) {
          stamps.push_back(seconds_of(m.header.stamp) - 1.7e9);
          answer.write(hover);
        });
        return stamps.size() >= 10;
      },
      30.0));
  const std::string said = flight->stop();
  expect_contains(said, "lockstep: a planner is there");
  EXPECT_EQ(said.find("no command within"), std::string::npos) << said;
  ASSERT_GE(stamps.size(), 10u) << said;
  for (std::size_t i = 0; i < stamps.size(); ++i)
    EXPECT_NEAR(stamps[i], 0.1 * static_cast<double>(i), 0.01);
}

/// Whoever plans the next mission finds the vehicle hovering; --no-stay ends with the first one.
TEST_F(Ros2, AfterItsMissionAVehicleStays) {
  const std::string scenario = *folder_ / "short.yaml";
  ASSERT_EQ(testing::run(fmt::format("scenario new {} -o {} --length 2", map(), scenario)).code, 0);
  Flight ends({scenario, "--ros2", "--ros2-localhost", "--no-stay"}, *folder_ / "ends.log");
  ends.wait();
  const std::string said = read_file(*folder_ / "ends.log");
  expect_contains(said, "completed");
  const std::string words = "completed, after ";
  const auto after = said.find(words);
  ASSERT_NE(after, std::string::npos) << said;
  const double seconds = std::stod(said.substr(after + words.size()));

  const auto stays = fly("--rate 4", scenario);
  Peer peer;
  Reader<rosgraph_msgs_msg_dds__Clock_> clock(
      peer, "rt/clock", rosgraph_msgs_msg_dds__Clock__desc, true);
  double now = 0.0;
  EXPECT_TRUE(eventually(
      [&] {
        clock.take([&](const auto& m) { now = seconds_of(m.clock) - 1.7e9; });
        return now > seconds + 3.0;
      },
      60.0))
      << now;
  expect_contains(stays->stop(), "interrupted");
}

/// Many times (POINTFLIGHT_RUNS), each at another moment.
TEST_F(Ros2, CtrlCWhileCommandsArrive) {
  const char* runs = std::getenv("POINTFLIGHT_RUNS");
  const int count = runs == nullptr ? 5 : std::atoi(runs);
  Peer peer;
  Reader<nav_msgs_msg_dds__Odometry_> odometry(
      peer, "rt/drone0/odom", nav_msgs_msg_dds__Odometry__desc, true);
  Writer<geometry_msgs_msg_dds__TwistStamped_> velocity(
      peer, "rt/drone0/cmd/velocity", geometry_msgs_msg_dds__TwistStamped__desc, true);
  Writer<geometry_msgs_msg_dds__PoseStamped_> goal(
      peer, "rt/drone0/goal", geometry_msgs_msg_dds__PoseStamped__desc, true);
  std::atomic<bool> over = false;
  std::thread sender([&] {
    char frame[] = "world";
    geometry_msgs_msg_dds__TwistStamped_ command{};
    command.header.frame_id = frame;
    geometry_msgs_msg_dds__PoseStamped_ aim{};
    aim.header.frame_id = frame;
    aim.pose.orientation.w = 1.0;
    while (!over) {
      velocity.try_write(command);
      goal.try_write(aim);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  std::mt19937 random(3);
  for (int i = 0; i < count; ++i) {
    odometry.take([](const auto&) {});
    const auto flight = fly();
    EXPECT_TRUE(eventually([&] { return odometry.take([](const auto&) {}) > 0; }, 60.0));
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 400));
    expect_contains(flight->stop(), "interrupted, after");
    EXPECT_EQ(flight->exit_code(), 130) << read_file(*folder_ / "fly.log");
  }
  over = true;
  sender.join();
}

/// Transforms are there for who comes while the run is paused.
TEST_F(Ros2, TransformsAreThereAtOnce) {
  const auto flight = fly();
  Peer peer;
  Writer<std_msgs_msg_dds__Bool_> pause(
      peer, "rt/pointflight/pause", std_msgs_msg_dds__Bool__desc, true);
  ASSERT_TRUE(eventually([&] { return pause.matched(); }));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  pause.write({true});
  ASSERT_TRUE(eventually(
      [&] { return read_file(*folder_ / "fly.log").find("paused") != std::string::npos; }));
  Reader<tf2_msgs_msg_dds__TFMessage_> tf(peer, "rt/tf", tf2_msgs_msg_dds__TFMessage__desc, true);
  Reader<tf2_msgs_msg_dds__TFMessage_> fixed(
      peer, "rt/tf_static", tf2_msgs_msg_dds__TFMessage__desc, true, true);
  int moving = 0;
  int still = 0;
  EXPECT_TRUE(eventually([&] {
    moving += tf.take([](const auto&) {});
    still += fixed.take([](const auto&) {});
    return moving > 0 && still > 0;
  })) << moving
      << " " << still;
}

}  // namespace
}  // namespace pointflight
