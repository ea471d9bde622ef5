// Any messages as a recorded survey: rays, or an InputError of one line.
//
// The input is a list of messages, each a byte that says what it is (bits 0 to 2 the type and
// topic, bit 3 the wire), two bytes of its length, and its bytes. An input whose first byte is 255
// is taken as edits (message, offset, value) of a good recording.
#include "pointflight/recording/recorded_survey.hpp"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/ros/common/codec.hpp"
#include "pointflight/ros/common/conversion.hpp"
#include "pointflight/ros/common/point_layout.hpp"

namespace pointflight {
namespace {

constexpr const char* kTypes[] = {"sensor_msgs/msg/PointCloud2",
                                  "livox_ros_driver2/msg/CustomMsg",
                                  "nav_msgs/msg/Odometry",
                                  "geometry_msgs/msg/PoseStamped",
                                  "tf2_msgs/msg/TFMessage",
                                  "sensor_msgs/PointCloud2",
                                  "nav_msgs/Odometry",
                                  "PointCloud2"};
constexpr const char* kTopics[] = {
    "/points", "/points", "/odom", "/odom", "/tf_static", "/points", "/odom", "/points\n"};

struct Message {
  unsigned kind = 0;
  std::vector<std::byte> bytes;
};

class Messages : public MessageReader {
 public:
  Messages(const std::vector<Message>& messages, Wire wire) : messages_(messages), wire_(wire) {}
  [[nodiscard]] Wire wire() const override { return wire_; }
  [[nodiscard]] double share_read() const override { return 0.5; }
  bool next(Recorded& message) override {
    if (at_ == messages_.size()) return false;
    const Message& m = messages_[at_++];
    message = {kTopics[m.kind], kTypes[m.kind], 0, m.bytes.data(), m.bytes.size()};
    return true;
  }

 private:
  const std::vector<Message>& messages_;
  Wire wire_;
  std::size_t at_ = 0;
};

std::vector<Message> good_recording() {
  std::vector<Message> messages;
  for (int i = 0; i < 3; ++i) {
    msg::Odometry odometry;
    odometry.header = header_of(SimTime(std::chrono::seconds(i)), {}, "map");
    odometry.child_frame_id = "base";
    odometry.pose.pose.position.x = i;
    messages.push_back({2, encode<Wire::kCdr>(odometry)});
  }
  const msg::Header header = header_of(SimTime{}, {}, "base");
  messages.push_back(
      {4, encode<Wire::kCdr>(msg::TFMessage{{transform_of(Pose{}, header, "lidar")}})});
  Scan scan;
  scan.start = SimTime(std::chrono::milliseconds(500));
  for (int i = 0; i < 3; ++i) {
    ScanPoint& point = scan.points.emplace_back();
    point.position_sensor = {3.0f, static_cast<float>(i), 0.0f};
    point.time_offset = std::chrono::milliseconds(10 * i);
  }
  messages.push_back({0, encode<Wire::kCdr>(cloud_of(scan, point_layout("livox"), "lidar", {}))});
  messages.push_back({0, encode<Wire::kCdr>(cloud_of(scan, point_layout("ouster"), "lidar", {}))});
  messages.push_back({1, encode<Wire::kCdr>(custom_cloud_of(scan, "lidar", {}))});
  return messages;
}

std::vector<Message> messages_in(const std::uint8_t* data, std::size_t size) {
  std::vector<Message> messages;
  while (size >= 3) {
    const std::size_t length =
        std::min<std::size_t>(size - 3, data[1] | static_cast<std::size_t>(data[2]) << 8);
    const auto* bytes = reinterpret_cast<const std::byte*>(data + 3);
    messages.push_back({data[0] & 7u, {bytes, bytes + length}});
    data += 3 + length;
    size -= 3 + length;
  }
  return messages;
}

std::vector<Message> edited(std::vector<Message> messages,
                            const std::uint8_t* data,
                            std::size_t size) {
  constexpr std::size_t kEdit = 7;
  for (; size >= kEdit; data += kEdit, size -= kEdit) {
    auto& bytes = messages[data[0] % messages.size()].bytes;
    const std::size_t at = data[1] | static_cast<std::size_t>(data[2]) << 8;
    std::memcpy(bytes.data() + at % (bytes.size() - 3), data + 3, 4);
  }
  return messages;
}

}  // namespace
}  // namespace pointflight

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace pointflight;
  if (size == 0) return 0;
  static const std::vector<Message> good = good_recording();
  const std::vector<Message> messages =
      data[0] == 255 ? edited(good, data + 1, size - 1) : messages_in(data, size);
  const Wire wire = data[0] != 255 && (data[0] & 8u) != 0 ? Wire::kRos1 : Wire::kCdr;
  try {
    RecordedSurveyOptions options;
    options.name = "input";
    const RecordedSurvey survey(
        [&](const auto&) { return std::make_unique<Messages>(messages, wire); }, options);
    const auto reader = survey.open();
    std::vector<SurveyRay> batch;
    while (reader->read(batch)) {
      for (const SurveyRay& ray : batch) {
        if (!ray.origin_world.allFinite() || !std::isfinite(ray.range)) __builtin_trap();
        if (!(std::abs(ray.direction_world.norm() - 1.0f) <= 1e-3f)) __builtin_trap();
      }
    }
  } catch (const InputError& error) {
    const std::string text = error.what();
    if (text.empty() || text.find('\n') != std::string::npos) __builtin_trap();
  }
  return 0;
}
