// Large clouds and stock receive buffers: alone on the machine. What it costs: ./dev bench ros.
#include <string>

#include "tests/ros2/fixture.hpp"

namespace pointflight {
namespace {

using testing::eventually;
using testing::Peer;
using testing::Reader;
using testing::Ros2;
using testing::run;
using testing::write_file;

/// 20,000 and 130,000 points at 10 Hz into stock receive buffers: none are lost. Told by the
/// clouds' own stamps, which a busy machine does not change.
TEST_F(Ros2, CloudsArriveWhole) {
  // a room: every beam comes back
  const std::string room = *folder_ / "room.pfmap";
  std::string points;
  for (int i = 0; i < 60; ++i) {
    for (int j = 0; j < 60; ++j) {
      const double u = 0.1 * i;
      const double v = 0.1 * j;
      for (const double w : {0.0, 6.0}) {
        points += fmt::format("{} {} {}\n{} {} {}\n{} {} {}\n", u, v, w, u, w, v, w, u, v);
      }
    }
  }
  write_file(*folder_ / "room.xyz", points);
  ASSERT_EQ(
      run(fmt::format(
              "map import {} -o {} --resolution 0.2 --keep-outliers", *folder_ / "room.xyz", room))
          .code,
      0);
  for (const char* lidar : {"mid360", "os1_128"}) {
    const std::string scenario = hovering_with({lidar}, room);
    for (const bool reliable : {false, true}) {
      std::uint32_t width = 0;
      int count = 0;
      double first = 0.0;
      double last = 0.0;
      Peer peer;
      Reader<sensor_msgs_msg_dds__PointCloud2_> cloud(peer,
                                                      fmt::format("rt/drone0/{}/points", lidar),
                                                      sensor_msgs_msg_dds__PointCloud2__desc,
                                                      reliable);
      const auto flight = fly("", scenario);
      eventually(
          [&] {
            cloud.take([&](const auto& m) {
              last = m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec;
              if (count++ == 0) first = last;
              width = m.width;
            });
            return count >= 26;
          },
          60.0);
      const double share = (count - 1) / (10.0 * (last - first));  // of those in between
      fmt::print("{} {}: {} points, {:.1f} % of the clouds\n",
                 lidar,
                 reliable ? "reliable" : "best effort",
                 width,
                 100.0 * share);
      EXPECT_GE(count, 26) << lidar << (reliable ? " reliable" : " best effort");
      EXPECT_GT(width, std::string(lidar) == "mid360" ? 19000u : 125000u);
    }
  }
}

}  // namespace
}  // namespace pointflight
