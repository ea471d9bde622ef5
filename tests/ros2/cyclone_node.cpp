// A ROS 2 node as rmw_cyclonedds makes them: Cyclone DDS as it is, with types that idlc made.
#include <dds/dds.h>

#include <chrono>
#include <thread>

#include "messages.h"
#include "services.h"
#include "tests/ros2/node_options.hpp"

using pointflight::testing::Counted;
using pointflight::testing::NodeOptions;

namespace {

dds_entity_t reader_of(dds_entity_t participant,
                       const char* name,
                       const dds_topic_descriptor_t& type,
                       bool reliable,
                       bool latched = false) {
  const dds_entity_t topic = dds_create_topic(participant, &type, name, nullptr, nullptr);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(
      qos, reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, DDS_SECS(1));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
  if (latched) dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  const dds_entity_t reader = dds_create_reader(participant, topic, qos, nullptr);
  dds_delete_qos(qos);
  if (reader < 0) std::fprintf(stderr, "%s: %s\n", name, dds_strretcode(-reader));
  return reader;
}

template <class T>
void take(dds_entity_t reader, Counted& counted) {
  for (;;) {
    void* samples[8] = {};
    dds_sample_info_t infos[8];
    const int n = dds_take(reader, samples, infos, 8, 8);
    if (n <= 0) return;
    for (int i = 0; i < n; ++i) {
      if (!infos[i].valid_data) continue;
      const auto& stamp = static_cast<T*>(samples[i])->header.stamp;
      counted.take(stamp.sec + 1e-9 * stamp.nanosec);
    }
    dds_return_loan(reader, samples, n);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const NodeOptions options(argc, argv);
  const dds_entity_t participant = dds_create_participant(options.domain, nullptr, nullptr);
  if (participant < 0) {
    std::fprintf(stderr, "no participant: %s\n", dds_strretcode(-participant));
    return 1;
  }
  const dds_entity_t odometry =
      reader_of(participant, "rt/drone0/odom", nav_msgs_msg_dds__Odometry__desc, options.reliable);
  const dds_entity_t imu =
      reader_of(participant, "rt/drone0/imu", sensor_msgs_msg_dds__Imu__desc, options.reliable);
  const dds_entity_t cloud = reader_of(participant,
                                       "rt/drone0/mid360/points",
                                       sensor_msgs_msg_dds__PointCloud2__desc,
                                       options.reliable);
  // the graph, as every node reads and writes it, and what is latched
  const auto& info = rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc;
  reader_of(participant, "ros_discovery_info", info, true, true);
  reader_of(participant, "rt/tf_static", tf2_msgs_msg_dds__TFMessage__desc, true, true);
  reader_of(participant, "rt/map", sensor_msgs_msg_dds__PointCloud2__desc, true, true);
  const dds_entity_t graph =
      dds_create_topic(participant, &info, "ros_discovery_info", nullptr, nullptr);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  const dds_entity_t graph_writer = dds_create_writer(participant, graph, qos, nullptr);
  dds_delete_qos(qos);
  rmw_dds_common_msg_dds__ParticipantEntitiesInfo_ own{};
  dds_write(graph_writer, &own);
  // somebody who might command
  const dds_entity_t goals = dds_create_topic(
      participant, &geometry_msgs_msg_dds__PoseStamped__desc, "rt/drone0/goal", nullptr, nullptr);
  dds_create_writer(participant, goals, nullptr, nullptr);
  Counted odometries;
  Counted imus;
  Counted clouds;
  while (NodeOptions::told_to_end == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(options.slow ? 700 : 5));
    take<nav_msgs_msg_dds__Odometry_>(odometry, odometries);
    take<sensor_msgs_msg_dds__Imu_>(imu, imus);
    take<sensor_msgs_msg_dds__PointCloud2_>(cloud, clouds);
  }
  odometries.print("odometry");
  imus.print("imu");
  clouds.print("cloud");
  dds_delete(participant);
}
