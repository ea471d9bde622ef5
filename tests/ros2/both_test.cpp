// ROS 1 and ROS 2 from one program.
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <thread>

#include "tests/ros2/fixture.hpp"

namespace pointflight {
namespace {

using testing::eventually;
using testing::Peer;
using testing::Reader;
using testing::Ros2;
using testing::write_file;

/// One program, both ROSes: what a peer of each gets is the same.
TEST_F(Ros2, BothRosesAtOnceSayTheSame) {
  if (std::system("/usr/bin/python3 -c 'import rospy' 2>/dev/null") != 0 ||
      !std::filesystem::exists("/usr/bin/rosmaster")) {
    GTEST_SKIP() << "no rosmaster and rospy here";
  }
  // below those that the kernel gives away
  const std::string port = std::to_string(20000 + getpid() % 12000);
  const std::string home = *folder_ / "ros";
  setenv("ROS_MASTER_URI", ("http://127.0.0.1:" + port).c_str(), 1);
  setenv("ROS_IP", "127.0.0.1", 1);
  setenv("ROS_HOME", home.c_str(), 1);
  const pid_t master = fork();
  if (master == 0) {
    const int nothing = open("/dev/null", O_WRONLY);
    dup2(nothing, 1);
    dup2(nothing, 2);
    execl("/usr/bin/rosmaster", "rosmaster", "--core", "-p", port.c_str(), nullptr);
    _exit(127);
  }
  const auto flight = fly("--ros1");
  // 200 odometries as rospy reads them, written down
  write_file(*folder_ / "read.py",
             "import rospy\n"
             "from nav_msgs.msg import Odometry\n"
             "rospy.init_node('reader')\n"
             "got = []\n"
             "rospy.Subscriber('/drone0/odom', Odometry, got.append, queue_size=1000)\n"
             "while len(got) < 200: rospy.rostime.wallsleep(0.05)\n"
             "for m in got:\n"
             "    p = m.pose.pose.position\n"
             "    print(m.header.stamp.to_nsec(), p.x.hex(), p.y.hex(), p.z.hex())\n");
  const std::string out = *folder_ / "ros1.txt";
  std::map<std::int64_t, Vector3d> seen;
  {
    Peer peer;
    Reader<nav_msgs_msg_dds__Odometry_> odometry(
        peer, "rt/drone0/odom", nav_msgs_msg_dds__Odometry__desc, true);
    const auto look = [&] {
      odometry.take([&](const auto& m) {
        const auto& p = m.pose.pose.position;
        seen[m.header.stamp.sec * 1'000'000'000ll + m.header.stamp.nanosec] = {p.x, p.y, p.z};
      });
      return !seen.empty();
    };
    EXPECT_TRUE(eventually(look));  // the two have found each other: now the other ROS
    std::atomic<bool> done{false};
    std::thread ros1([&] {
      const std::string script = *folder_ / "read.py";
      EXPECT_EQ(std::system(("timeout 30 /usr/bin/python3 " + script + " > " + out).c_str()), 0);
      done = true;
    });
    eventually(
        [&] {
          look();
          return done.load();
        },
        40.0);
    ros1.join();
  }
  const std::string said = flight->stop();
  kill(master, SIGKILL);
  waitpid(master, nullptr, 0);
  std::ifstream lines(out);
  std::int64_t stamp = 0;
  std::string x, y, z;
  std::size_t common = 0;
  while (lines >> stamp >> x >> y >> z) {
    const auto found = seen.find(stamp);
    if (found == seen.end()) continue;
    ++common;
    EXPECT_EQ(found->second, Vector3d(std::stod(x), std::stod(y), std::stod(z))) << stamp;
  }
  EXPECT_GT(common, 100u) << said;
}

}  // namespace
}  // namespace pointflight
