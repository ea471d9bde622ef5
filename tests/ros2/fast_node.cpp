// A ROS 2 node as rmw_fastrtps makes them: Fast DDS as it is. It reads bytes and takes the stamps
// of their headers.
#include <chrono>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <thread>

#include "tests/ros2/fast_type.hpp"
#include "tests/ros2/node_options.hpp"

using pointflight::testing::Counted;
using pointflight::testing::FastSample;
using pointflight::testing::FastType;
using pointflight::testing::NodeOptions;
namespace fast = eprosima::fastdds::dds;
#if POINTFLIGHT_FAST_DDS >= 3
namespace fast_rtps = eprosima::fastdds::rtps;
const auto done = fast::RETCODE_OK;
#else
namespace fast_rtps = eprosima::fastrtps::rtps;
const auto done = ReturnCode_t::RETCODE_OK;
#endif

namespace {

fast::Topic* topic_of(fast::DomainParticipant& participant, const char* name, const char* type) {
  fast::TypeSupport support(new FastType(type));
  support.register_type(&participant);
  return participant.create_topic(name, type, fast::TOPIC_QOS_DEFAULT);
}

fast::DataReader* reader_of(fast::DomainParticipant& participant,
                            fast::Subscriber& subscriber,
                            const char* name,
                            const char* type,
                            bool reliable) {
  fast::DataReaderQos qos = fast::DATAREADER_QOS_DEFAULT;
  qos.reliability().kind =
      reliable ? fast::RELIABLE_RELIABILITY_QOS : fast::BEST_EFFORT_RELIABILITY_QOS;
  qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = 10;
  qos.endpoint().history_memory_policy = fast_rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  qos.data_sharing().off();
  return subscriber.create_datareader(topic_of(participant, name, type), qos);
}

void take(fast::DataReader& reader, Counted& counted) {
  FastSample sample;
  fast::SampleInfo info;
  while (reader.take_next_sample(&sample, &info) == done) {
    if (!info.valid_data || sample.in.size() < 12) continue;
    std::int32_t seconds = 0;
    std::uint32_t nanoseconds = 0;
    std::memcpy(&seconds, sample.in.data() + 4, 4);
    std::memcpy(&nanoseconds, sample.in.data() + 8, 4);
    counted.take(seconds + 1e-9 * nanoseconds);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const NodeOptions options(argc, argv);
  auto* factory = fast::DomainParticipantFactory::get_instance();
  auto* participant = factory->create_participant(options.domain, fast::PARTICIPANT_QOS_DEFAULT);
  if (participant == nullptr) return 1;
  auto* subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  auto* odometry = reader_of(*participant,
                             *subscriber,
                             "rt/drone0/odom",
                             "nav_msgs::msg::dds_::Odometry_",
                             options.reliable);
  auto* imu = reader_of(
      *participant, *subscriber, "rt/drone0/imu", "sensor_msgs::msg::dds_::Imu_", options.reliable);
  auto* cloud = reader_of(*participant,
                          *subscriber,
                          "rt/drone0/mid360/points",
                          "sensor_msgs::msg::dds_::PointCloud2_",
                          options.reliable);
  // somebody who might command
  auto* publisher = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
  publisher->create_datawriter(
      topic_of(*participant, "rt/drone0/goal", "geometry_msgs::msg::dds_::PoseStamped_"),
      fast::DATAWRITER_QOS_DEFAULT);
  Counted odometries;
  Counted imus;
  Counted clouds;
  while (NodeOptions::told_to_end == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(options.slow ? 700 : 5));
    take(*odometry, odometries);
    take(*imu, imus);
    take(*cloud, clouds);
  }
  odometries.print("odometry");
  imus.print("imu");
  clouds.print("cloud");
  participant->delete_contained_entities();
  factory->delete_participant(participant);
}
