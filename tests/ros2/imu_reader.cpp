// A reader of IMU samples as ROS' own sensor profile has it: best effort, the last five kept, one
// taken at a time. `imu_reader TOPIC`, until it is told to end; then it says how many came of how
// many, by their stamps, and how far apart they came.
#include <dds/dds.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "messages.h"
#include "tests/ros2/node_options.hpp"

namespace {

using pointflight::testing::NodeOptions;
using Clock = std::chrono::steady_clock;

constexpr double kRate = 200.0;  // Hz, of shipped vehicles
constexpr int kDepth = 5;

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

}  // namespace

int main(int argc, char** argv) {
  const NodeOptions options(argc, argv);
  const dds_entity_t participant = dds_create_participant(options.domain, nullptr, nullptr);
  const dds_entity_t topic = dds_create_topic(
      participant, &sensor_msgs_msg_dds__Imu__desc, argc > 1 ? argv[1] : "", nullptr, nullptr);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, kDepth);
  const dds_entity_t reader = dds_create_reader(participant, topic, qos, nullptr);
  dds_delete_qos(qos);
  const dds_entity_t waitset = dds_create_waitset(participant);
  dds_waitset_attach(waitset, dds_create_readcondition(reader, DDS_ANY_STATE), 0);
  std::vector<double> stamps;
  std::vector<double> gaps;  // ms, by the wall clock
  auto last = Clock::now();
  while (NodeOptions::told_to_end == 0) {
    if (dds_waitset_wait(waitset, nullptr, 0, DDS_MSECS(100)) <= 0) continue;
    void* sample = nullptr;
    dds_sample_info_t info;
    if (dds_take(reader, &sample, &info, 1, 1) <= 0) continue;
    if (info.valid_data) {
      const auto& stamp = static_cast<sensor_msgs_msg_dds__Imu_*>(sample)->header.stamp;
      const auto now = Clock::now();
      if (!stamps.empty()) {
        gaps.push_back(std::chrono::duration<double, std::milli>(now - last).count());
      }
      stamps.push_back(stamp.sec + 1e-9 * stamp.nanosec);
      last = now;
    }
    dds_return_loan(reader, &sample, 1);
  }
  dds_delete(participant);
  if (gaps.empty()) {
    std::printf("imu 0 of 0\n");
    return 1;
  }
  const double sent = std::round((stamps.back() - stamps.front()) * kRate) + 1.0;
  std::printf("imu %zu of %.0f, gaps %.1f ms (median) %.1f ms (p99) %.1f ms (most)\n",
              stamps.size(),
              sent,
              percentile(gaps, 0.5),
              percentile(gaps, 0.99),
              percentile(gaps, 1.0));
  return 0;
}
