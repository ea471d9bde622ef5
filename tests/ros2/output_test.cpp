// What a ROS 2 node gets from pointflight: the graph and every type that goes out. The peer has the
// receive buffers of a stock Linux, another DDS (Cyclone) and types of its own.
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "tests/ros2/fixture.hpp"

namespace pointflight {
namespace {

using testing::eventually;
using testing::Flight;
using testing::has_multicast;
using testing::Peer;
using testing::Reader;
using testing::Ros2;

double seconds_of(const std_msgs_msg_dds__Header_& header) {
  return header.stamp.sec - 1.7e9 + 1e-9 * header.stamp.nanosec;
}

TEST_F(Ros2, ANodeOfThisNameWithItsEndpointsIsInTheGraph) {
  Peer peer;
  Reader<rmw_dds_common_msg_dds__ParticipantEntitiesInfo_> graph(
      peer,
      "ros_discovery_info",
      rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc,
      true,
      true);
  const auto flight = fly();
  std::set<std::string> nodes;
  std::size_t writers = 0;
  std::size_t readers = 0;
  ASSERT_TRUE(eventually([&] {
    graph.take([&](const auto& info) {
      ASSERT_EQ(info.node_entities_info_seq._length, 1u);
      const auto& entry = info.node_entities_info_seq._buffer[0];
      nodes.insert(std::string(entry.node_namespace) + entry.node_name);
      writers += entry.writer_gid_seq._length;
      readers += entry.reader_gid_seq._length;
    });
    return !nodes.empty();
  })) << flight->stop();
  EXPECT_EQ(nodes, std::set<std::string>{"/pointflight"});
  EXPECT_EQ(writers, 13u + 3u);       // and the replies of services
  EXPECT_EQ(readers, 12u + 5u + 3u);  // what comes once is read reliably as well; services

  // each endpoint says its type's hash
  std::map<std::string, std::string> types;
  std::map<std::string, std::string> hashes;
  std::set<std::string> reliable;
  for (const dds_entity_t builtin :
       {DDS_BUILTIN_TOPIC_DCPSPUBLICATION, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION}) {
    const dds_entity_t reader = dds_create_reader(peer.participant(), builtin, nullptr, nullptr);
    eventually(
        [&] {
          void* samples[100] = {};
          dds_sample_info_t infos[100];
          const int n = dds_read(reader, samples, infos, 100, 100);
          for (int i = 0; i < n; ++i) {
            if (!infos[i].valid_data) continue;
            const auto* e = static_cast<dds_builtintopic_endpoint_t*>(samples[i]);
            void* data = nullptr;
            std::size_t size = 0;
            dds_reliability_kind_t kind = DDS_RELIABILITY_BEST_EFFORT;
            dds_duration_t blocking = 0;
            dds_qget_reliability(e->qos, &kind, &blocking);
            if (dds_qget_userdata(e->qos, &data, &size) && size > 0) {
              if (kind == DDS_RELIABILITY_RELIABLE) reliable.insert(e->topic_name);
              const auto other = types.find(e->topic_name);
              EXPECT_TRUE(other == types.end() || other->second == e->type_name)
                  << e->topic_name << " has two types";
              hashes[e->topic_name] = std::string(static_cast<char*>(data), size);
              types[e->topic_name] = e->type_name;
            }
            dds_free(data);
          }
          if (n > 0) dds_return_loan(reader, samples, n);
          return types.contains("rt/drone0/odom") && types.contains("rt/drone0/goal") &&
                 types.contains("rt/drone0/cmd/position_mars");
        },
        5.0);
    dds_delete(reader);
  }
  // what comes once is read reliably
  for (const char* topic : {"drone0/goal",
                            "drone0/cmd/takeoff_land",
                            "pointflight/pause",
                            "pointflight/step",
                            "pointflight/reset"}) {
    EXPECT_TRUE(reliable.contains(std::string("rt/") + topic)) << topic;
  }
  EXPECT_FALSE(reliable.contains("rt/drone0/cmd/velocity"));
  EXPECT_EQ(types["rt/drone0/odom"], "nav_msgs::msg::dds_::Odometry_");
  EXPECT_EQ(hashes["rt/drone0/odom"],
            "typehash=RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0;");
  EXPECT_EQ(types["rt/drone0/mid360/points"], "sensor_msgs::msg::dds_::PointCloud2_");
  EXPECT_EQ(hashes["rt/drone0/mid360/points"],
            "typehash=RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5;");
  EXPECT_EQ(hashes["rt/drone0/goal"],
            "typehash=RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8;");
  EXPECT_EQ(hashes["rt/tf"],
            "typehash=RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087;");
}

TEST_F(Ros2, IsFoundByAPeerInTheDefaultEnvironment) {
  if (!has_multicast()) GTEST_SKIP() << "no network with multicast here";
  for (const char* variable : {"ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY"}) {
    unsetenv(variable);
  }
  Flight flight({map(), "--ros2"}, *folder_ / "default.log");
  Peer peer(true);
  Reader<nav_msgs_msg_dds__Odometry_> odometry(
      peer, "rt/drone0/odom", nav_msgs_msg_dds__Odometry__desc, true);
  int count = 0;
  EXPECT_TRUE(eventually([&] { return (count += odometry.take([](const auto&) {})) > 50; }))
      << flight.stop();
}

TEST_F(Ros2, EveryTypeArrivesReliableAndBestEffort) {
  const std::string scenario =
      hovering_with({"mid360"}, map(), "obstacles:\n  - {count: 3, radius: 0.1, speed: 0.5}\n");
  for (const bool reliable : {true, false}) {
    Peer peer;
    Reader<nav_msgs_msg_dds__Odometry_> odometry(
        peer, "rt/drone0/odom", nav_msgs_msg_dds__Odometry__desc, reliable);
    Reader<sensor_msgs_msg_dds__Imu_> imu(
        peer, "rt/drone0/imu", sensor_msgs_msg_dds__Imu__desc, reliable);
    Reader<sensor_msgs_msg_dds__PointCloud2_> cloud(
        peer, "rt/drone0/mid360/points", sensor_msgs_msg_dds__PointCloud2__desc, reliable);
    Reader<tf2_msgs_msg_dds__TFMessage_> tf(
        peer, "rt/tf", tf2_msgs_msg_dds__TFMessage__desc, reliable);
    Reader<tf2_msgs_msg_dds__TFMessage_> fixed(
        peer, "rt/tf_static", tf2_msgs_msg_dds__TFMessage__desc, reliable, reliable);
    Reader<rosgraph_msgs_msg_dds__Clock_> clock(
        peer, "rt/clock", rosgraph_msgs_msg_dds__Clock__desc, reliable);
    Reader<nav_msgs_msg_dds__Path_> path(
        peer, "rt/drone0/path", nav_msgs_msg_dds__Path__desc, reliable);
    Reader<visualization_msgs_msg_dds__Marker_> model(
        peer, "rt/drone0/model", visualization_msgs_msg_dds__Marker__desc, reliable);
    Reader<visualization_msgs_msg_dds__MarkerArray_> obstacles(
        peer, "rt/obstacles", visualization_msgs_msg_dds__MarkerArray__desc, reliable);
    Reader<diagnostic_msgs_msg_dds__DiagnosticArray_> diagnostics(
        peer, "rt/diagnostics", diagnostic_msgs_msg_dds__DiagnosticArray__desc, reliable);
    const auto flight = fly("", scenario);
    std::map<std::string, int> counts;
    double last = -1.0;
    double up = 0.0;
    const auto all_there = [&] {
      counts["odometry"] += odometry.take([&](const auto& m) {
        EXPECT_STREQ(m.header.frame_id, "world");
        EXPECT_STREQ(m.child_frame_id, "drone0/base_link");
        EXPECT_GT(seconds_of(m.header), last);
        last = seconds_of(m.header);
      });
      counts["imu"] += imu.take([&](const auto& m) { up += m.linear_acceleration.z; });
      counts["cloud"] += cloud.take([](const auto& m) {
        EXPECT_EQ(m.data._length, m.width * m.point_step);
        EXPECT_EQ(m.point_step, 26u);
        EXPECT_STREQ(m.fields._buffer[6].name, "timestamp");
        EXPECT_GT(m.width, 1000u);
      });
      counts["tf"] += tf.take([](const auto& m) {
        EXPECT_STREQ(m.transforms._buffer[0].child_frame_id, "drone0/base_link");
      });
      counts["fixed"] += fixed.take([](const auto& m) {
        EXPECT_STREQ(m.transforms._buffer[0].child_frame_id, "drone0/mid360");
      });
      counts["clock"] += clock.take([](const auto& m) { EXPECT_GE(m.clock.sec, 1700000000); });
      counts["path"] += path.take([](const auto& m) { EXPECT_GE(m.poses._length, 1u); });
      counts["model"] += model.take([](const auto& m) { EXPECT_STREQ(m.ns, "model"); });
      counts["obstacles"] +=
          obstacles.take([](const auto& m) { EXPECT_EQ(m.markers._length, 3u); });
      counts["diagnostics"] += diagnostics.take(
          [](const auto& m) { EXPECT_STREQ(m.status._buffer[0].name, "pointflight: drone0"); });
      if (counts["odometry"] < 300 || counts["cloud"] < 10 || counts["diagnostics"] < 1) {
        return false;
      }
      for (const auto& [name, count] : counts) {
        if (count == 0 && (reliable || name != "fixed")) return false;
      }
      return true;
    };
    EXPECT_TRUE(eventually(all_there, 30.0)) << flight->stop();
    EXPECT_NEAR(up / counts["imu"], 9.81, 0.3);  // the mean: rotors shake each sample
    for (const auto& [name, count] : counts) {
      EXPECT_TRUE(count > 0 || (name == "fixed" && !reliable)) << name;
    }
  }
}

/// Pictures of a depth camera, and Livox' own message.
TEST_F(Ros2, PicturesAndCustomMessagesArriveReliableAndBestEffort) {
  const std::string scenario =
      hovering_with({"mid360", "d455"},
                    map(),
                    "ros:\n  outputs:\n    - {kind: cloud, layout: livox_custom, "
                    "topic: \"/{vehicle}/{lidar}/custom\"}\n");
  const auto flight = fly("", scenario);
  for (const bool reliable : {true, false}) {
    Peer peer;
    Reader<sensor_msgs_msg_dds__Image_> images(
        peer, "rt/drone0/d455/depth", sensor_msgs_msg_dds__Image__desc, reliable);
    Reader<sensor_msgs_msg_dds__CameraInfo_> infos(
        peer, "rt/drone0/d455/camera_info", sensor_msgs_msg_dds__CameraInfo__desc, reliable);
    Reader<livox_ros_driver2_msg_dds__CustomMsg_> clouds(
        peer, "rt/drone0/mid360/custom", livox_ros_driver2_msg_dds__CustomMsg__desc, reliable);
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    int image_count = 0;
    int info_count = 0;
    int cloud_count = 0;
    EXPECT_TRUE(eventually([&] {
      image_count += images.take([&](const auto& m) {
        width = m.width;
        height = m.height;
        EXPECT_STREQ(m.header.frame_id, "drone0/d455_optical");
        EXPECT_STREQ(m.encoding, "32FC1");
        EXPECT_EQ(m.step, 4 * m.width);
        ASSERT_EQ(m.data._length, m.height * m.step);
        std::vector<float> depths(std::size_t{m.width} * m.height);
        std::memcpy(depths.data(), m.data._buffer, m.data._length);
        std::size_t seen = 0;
        for (const float depth : depths) {
          ASSERT_TRUE(depth >= 0.0f && depth < 100.0f) << depth;
          seen += depth > 0.0f ? 1 : 0;
        }
        EXPECT_GT(seen, depths.size() / 20);
      });
      info_count += infos.take([&](const auto& m) {
        EXPECT_STREQ(m.header.frame_id, "drone0/d455_optical");
        EXPECT_STREQ(m.distortion_model, "plumb_bob");
        EXPECT_EQ(m.d._length, 5u);
        EXPECT_GT(m.k[0], 0.0);
        EXPECT_NEAR(m.k[2], 0.5 * m.width, 10.0);
        EXPECT_EQ(m.p[0], m.k[0]);
        EXPECT_EQ(m.r[0], 1.0);
        EXPECT_TRUE(width == 0 || (m.width == width && m.height == height));
      });
      cloud_count += clouds.take([&](const auto& m) {
        EXPECT_STREQ(m.header.frame_id, "drone0/mid360");
        EXPECT_EQ(m.point_num, m.points._length);
        ASSERT_GT(m.point_num, 1000u);
        EXPECT_EQ(m.timebase, 1'000'000'000ull * m.header.stamp.sec + m.header.stamp.nanosec);
        EXPECT_EQ(m.points._buffer[0].offset_time, 0u);
        int far = 0;
        for (std::uint32_t i = 1; i < m.point_num; ++i) {
          const auto& point = m.points._buffer[i];
          ASSERT_GE(point.offset_time, m.points._buffer[i - 1].offset_time);
          ASSERT_LT(point.offset_time, 100'000'000u);
          ASSERT_LT(point.line, 4);
          ASSERT_EQ(point.tag, 16);
          // but for false returns, one of 10^4 beams
          far += std::hypot(point.x, point.y, point.z) < 70.0 ? 0 : 1;
        }
        EXPECT_LT(far, 20);
      });
      return image_count > 10 && info_count > 10 && cloud_count > 5;
    })) << image_count
        << " " << info_count << " " << cloud_count << "\n"
        << flight->stop();
  }
}

/// Types that only other programs' profiles send.
TEST_F(Ros2, PosesAndRotorSpeedsArriveReliableAndBestEffort) {
  const auto flight = fly("--profile marsim");
  for (const bool reliable : {true, false}) {
    Peer peer;
    Reader<geometry_msgs_msg_dds__PoseStamped_> poses(peer,
                                                      "rt/quad0_pcl_render_node/sensor_pose",
                                                      geometry_msgs_msg_dds__PoseStamped__desc,
                                                      reliable);
    Reader<std_msgs_msg_dds__Float32MultiArray_> rotors(
        peer, "rt/quad_0/cmdRPM", std_msgs_msg_dds__Float32MultiArray__desc, reliable);
    int pose_count = 0;
    int rotor_count = 0;
    EXPECT_TRUE(eventually([&] {
      pose_count += poses.take([](const auto& m) {
        EXPECT_STREQ(m.header.frame_id, "map");
        const auto& q = m.pose.orientation;
        EXPECT_NEAR(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w, 1.0, 1e-9);
        EXPECT_GT(m.pose.position.z, 0.0);
      });
      rotor_count += rotors.take([](const auto& m) {
        ASSERT_EQ(m.data._length, 4u);
        for (int i = 0; i < 4; ++i) {
          EXPECT_TRUE(m.data._buffer[i] > 100.0f && m.data._buffer[i] < 40000.0f)
              << m.data._buffer[i];
        }
      });
      return pose_count > 5 && rotor_count > 100;
    })) << pose_count
        << " " << rotor_count << "\n"
        << flight->stop();
  }
}

TEST_F(Ros2, ALateReaderGetsTheMap) {
  const auto flight = fly();
  Peer peer;
  Reader<rosgraph_msgs_msg_dds__Clock_> clock(
      peer, "rt/clock", rosgraph_msgs_msg_dds__Clock__desc, false);
  int ticks = 0;
  ASSERT_TRUE(eventually([&] { return (ticks += clock.take([](const auto&) {})) > 100; }))
      << flight->stop();
  Reader<sensor_msgs_msg_dds__PointCloud2_> map_reader(
      peer, "rt/map", sensor_msgs_msg_dds__PointCloud2__desc, true, true);
  std::uint32_t points = 0;
  EXPECT_TRUE(eventually([&] {
    map_reader.take([&](const auto& m) { points = m.width; });
    return points > 0;
  })) << flight->stop();
  EXPECT_GT(points, 1000u);
}

}  // namespace
}  // namespace pointflight
