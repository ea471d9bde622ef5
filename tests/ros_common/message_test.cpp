// Messages against what the two ROSes publish of them: md5 sums, type hashes, sizes and bytes.
#include <gtest/gtest.h>

#include <tuple>

#include "pointflight/core/random.hpp"
#include "pointflight/ros/common/description.hpp"
#include "tests/paths.hpp"
#include "tests/support.hpp"

namespace pointflight::msg {
namespace {

/// Every message that goes over a wire by itself.
using AllMessages = std::tuple<PointCloud2,
                               Imu,
                               Image,
                               CameraInfo,
                               Joy,
                               Odometry,
                               Path,
                               TFMessage,
                               Clock,
                               Marker,
                               MarkerArray,
                               PoseStamped,
                               TwistStamped,
                               Bool,
                               Empty,
                               String,
                               CustomMsg,
                               AttitudeTarget,
                               PositionCommandShort,
                               PositionCommandLong,
                               PositionCommandOldest,
                               Float32MultiArray,
                               TakeoffLand,
                               DiagnosticArray>;

/// Calls `visit` with a default-constructed message of each type.
template <class Visit>
void for_each_message(const Visit& visit) {
  std::apply([&](const auto&... message) { (visit(message), ...); }, AllMessages{});
}

struct Published {
  const char* name;  ///< In ROS 1.
  const char* md5;
  const char* hash;  ///< Without "RIHS01_"; "": none known.
};

// md5 by the Noetic message tools, hashes by Jazzy's generator
constexpr Published kPublished[] = {
    {"sensor_msgs/PointCloud2",
     "1158d486dd51d683ce2f1be655c3c181",
     "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"},
    {"sensor_msgs/Imu",
     "6a62c6daae103f4ff57a132d6f95cec2",
     "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"},
    {"sensor_msgs/Image",
     "060021388200f6f0f447d0fcd9c64743",
     "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"},
    {"sensor_msgs/CameraInfo",
     "c9a58c1b0b154e0e6da7578cb991d214",
     "b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"},
    {"sensor_msgs/Joy",
     "5a9ea5f83505693b71e785041e67a8bb",
     "0d356c79cad3401e35ffeb75a96a96e08be3ef896b8b83841d73e890989372c5"},
    {"nav_msgs/Odometry",
     "cd5e73d190d741a2f92e81eda573aca7",
     "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
    {"nav_msgs/Path",
     "6227e2b7e9cce15051f669a5e197bbf7",
     "1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b"},
    {"tf2_msgs/TFMessage",
     "94810edda583a504dfda3829e70d7eec",
     "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
    {"rosgraph_msgs/Clock",
     "a9c97c1d230cfc112e270351a944ee47",
     "692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564"},
    {"visualization_msgs/Marker",
     "4048c9de2a16f4ae8e0538085ebf1b97",
     "45b13ccf791f225962bf74e746f9644518855d783a6f42ba0cc14fde2b4f3ce0"},
    {"visualization_msgs/MarkerArray",
     "d155b9ce5188fbaf89745847fd5882d7",
     "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"},
    {"geometry_msgs/PoseStamped",
     "d3812c3cbc69362b77dc0b19b345f8f5",
     "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"},
    {"geometry_msgs/TwistStamped",
     "98d34b0043a2093cf9d9345ab6eef12e",
     "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64"},
    {"std_msgs/Bool",
     "8b94c1b53db61fb6aed406028ad6332a",
     "feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9"},
    {"std_msgs/Empty",
     "d41d8cd98f00b204e9800998ecf8427e",
     "20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312"},
    {"std_msgs/String",
     "992ce8a1687cec8c8bd883ec73ca41d1",
     "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"},
    {"livox_ros_driver2/CustomMsg",
     "e4d6829bdfe657cb6c21a746c86b21a6",
     "2eb17e5e35bf5a2d6cd079f3c57f33abf95e5bf7d71b42cddc05daace73d815a"},
    {"mavros_msgs/AttitudeTarget",
     "456f3af666b22ccd0222ea053a86b548",
     "4b73630cb236d7e19f68f2366a565145460c507603df32bc3ff209554b88fe10"},
    {"quadrotor_msgs/PositionCommand",
     "4712f0609ca29a79af79a35ca3e3967a",
     "90597c314004b3e71785b5bf557a21eb0e97833c899b8052e76c9c27bfd7732a"},
    {"quadrotor_msgs/PositionCommand", "d008e86de36e11deb1e4033ac2c394a9", ""},
    {"quadrotor_msgs/PositionCommand", "835935bcd6f18632d9e26a3093237902", ""},
    {"std_msgs/Float32MultiArray", "6a40e0ffa6a17a503ac3f8616991b1f6", ""},
    {"quadrotor_msgs/TakeoffLand", "b30b3b93263aae01746755d3b8ff620f", ""},
    {"diagnostic_msgs/DiagnosticArray", "60810da900de1dd6ddd437c3503511da", ""},
};

TEST(MessageTypes, HaveTheSumsAndHashesThatArePublished) {
  std::size_t i = 0;
  for_each_message([&](const auto& message) {
    using M = std::decay_t<decltype(message)>;
    const MessageType type = message_type<M>();
    ASSERT_LT(i, std::size(kPublished));
    const Published& published = kPublished[i++];
    EXPECT_EQ(type.ros1_name(), published.name);
    EXPECT_EQ(type.md5, published.md5) << published.name;
    if (*published.hash != '\0') {
      EXPECT_EQ(type.hash, std::string("RIHS01_") + published.hash) << published.name;
    }
  });
  EXPECT_EQ(i, std::size(kPublished));
  EXPECT_EQ(message_type<PositionCommandLong>().ros2_name(),
            "mars_quadrotor_msgs/msg/PositionCommand");
  EXPECT_TRUE(message_type<PositionCommandOldest>().hash.empty());  // ROS 1 only
}

TEST(MessageTypes, DefinitionsNameNestedTypesOnce) {
  const std::string text = message_type<Path>().definition;
  EXPECT_TRUE(text.starts_with("std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n"));
  const std::string head = "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
  EXPECT_NE(text.find(head), std::string::npos);
  EXPECT_EQ(text.find(head), text.rfind(head));
  const std::string ros2 = message_type<Path>().ros2_definition;
  EXPECT_NE(ros2.find("MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"),
            std::string::npos);
  EXPECT_EQ(ros2.find("seq"), std::string::npos);
}

TEST(MessageTypes, TheFilesForWorkspacesSayTheSame) {
  const auto expect_file = [](const std::string& path, const TypeDescription& type) {
    const std::string text = definition_text(type, 2);
    EXPECT_EQ(testing::read_file(std::string(testing::kSource) + "/ros_packages/messages/" + path),
              text.substr(0, text.find("====")))
        << path;
  };
  expect_file("quadrotor_msgs/msg/PositionCommand.msg", describe_message<PositionCommandShort>(2));
  expect_file("quadrotor_msgs/msg/TakeoffLand.msg", describe_message<TakeoffLand>(2));
  expect_file("mars_quadrotor_msgs/msg/PositionCommand.msg",
              describe_message<PositionCommandLong>(2));
}

std::string hex(std::span<const std::byte> bytes) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::byte b : bytes) {
    text += kDigits[std::to_integer<int>(b) >> 4];
    text += kDigits[std::to_integer<int>(b) & 15];
  }
  return text;
}

TEST(Cdr, EqualsWhatRclpyWrites) {
  EXPECT_EQ(encode<Wire::kCdr>(PointCloud2{}).size(), 49u);
  EXPECT_EQ(encode<Wire::kCdr>(Odometry{}).size(), 708u);
  EXPECT_EQ(encode<Wire::kCdr>(Path{}).size(), 24u);
  EXPECT_EQ(encode<Wire::kCdr>(TFMessage{}).size(), 8u);
  EXPECT_EQ(encode<Wire::kCdr>(Clock{}).size(), 12u);
  EXPECT_EQ(encode<Wire::kCdr>(Marker{}).size(), 229u);
  EXPECT_EQ(encode<Wire::kCdr>(AttitudeTarget{}).size(), 80u);
  CustomMsg custom;
  const std::size_t sizes[] = {40, 59, 79, 99};
  for (const std::size_t size : sizes) {
    EXPECT_EQ(encode<Wire::kCdr>(custom).size(), size);
    custom.points.emplace_back();
  }
  custom.points.clear();
  custom.header.frame_id = "abc";
  custom.timebase = 0x1122334455667788;
  custom.point_num = 1;
  custom.points.push_back({5, 1.0f, 0.0f, 0.0f, 9, 16, 3});
  EXPECT_EQ(
      hex(encode<Wire::kCdr>(custom)),
      "000100000000000000000000040000006162630088776655443322110100000000000000010000000500000"
      "00000803f0000000000000000091003");
}

TEST(Ros1Wire, PacksWithoutGaps) {
  CustomMsg custom;
  custom.points.resize(2);
  // seq, stamp, length of the frame; timebase, number, id, reserved; length and 19 bytes per point
  EXPECT_EQ(encode<Wire::kRos1>(custom).size(), 16u + 8 + 4 + 1 + 3 + 4 + 2 * 19);
  EXPECT_EQ(encode<Wire::kRos1>(Empty{}).size(), 0u);
  Joy joy;
  joy.header.seq = 7;
  joy.header.stamp = {1, 2};
  joy.header.frame_id = "ab";
  joy.axes = {1.0f};
  EXPECT_EQ(hex(encode<Wire::kRos1>(joy)),
            "070000000100000002000000020000006162010000000000803f00000000");
}

/// Fills a message with values from a stream, everything non-trivial.
class Filler {
 public:
  static constexpr int kRos = 2;
  explicit Filler(std::uint64_t seed) : random_(seed, StreamId::kTest, 77) {}

  template <class T>
  void operator()(const char* /*name*/, T& value) {
    fill(value);
  }

 private:
  template <detail::Number T>
  void fill(T& value) {
    const double u = random_.uniform(index_++);
    if constexpr (std::is_same_v<T, bool>) {
      value = u > 0.5;
    } else if constexpr (std::is_enum_v<T>) {
      value = static_cast<T>(u * 3.0);
    } else {
      value = static_cast<T>(u * 100.0);
    }
  }
  void fill(std::string& text) {
    text = std::string(static_cast<std::size_t>(random_.uniform(index_++) * 9.0), 'x');
  }
  template <class T>
  void fill(std::vector<T>& items) {
    items.resize(static_cast<std::size_t>(random_.uniform(index_++) * 4.0));
    for (T& item : items) fill(item);
  }
  template <class T, std::size_t N>
  void fill(std::array<T, N>& items) {
    for (T& item : items) fill(item);
  }
  template <detail::Message M>
  void fill(M& message) {
    M::fields(message, *this);
  }
  RandomStream random_;
  std::uint64_t index_ = 0;
};

template <Wire W, class M>
void expect_round_trip(const M& message) {
  const auto bytes = encode<W>(message);
  const auto back = decode<W, M>(bytes);
  ASSERT_TRUE(back) << M::kType.name;
  EXPECT_EQ(encode<W>(*back), bytes) << M::kType.name;
  // cut anywhere, it is refused; CDR may leave out padding that nobody reads
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE((decode<W, M>(std::span(bytes).first(size)))) << M::kType.name << " " << size;
  }
  auto longer = bytes;
  longer.resize(bytes.size() + 4);
  EXPECT_FALSE((decode<W, M>(longer)));
}

TEST(Wires, EveryMessageComesBackAsItWas) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for_each_message([&](auto message) {
      Filler filler(seed);
      using M = decltype(message);
      M::fields(message, filler);
      expect_round_trip<Wire::kRos1>(message);
      expect_round_trip<Wire::kCdr>(message);
    });
  }
}

TEST(Cdr, ToleratesPaddingAndReadsBothByteOrders) {
  Clock clock{{0x01020304, 5}};
  auto bytes = encode<Wire::kCdr>(clock);
  bytes.resize(bytes.size() + 3);
  ASSERT_TRUE((decode<Wire::kCdr, Clock>(bytes)));
  const std::byte big[] = {std::byte{0},
                           std::byte{0},
                           std::byte{0},
                           std::byte{0},
                           std::byte{1},
                           std::byte{2},
                           std::byte{3},
                           std::byte{4},
                           std::byte{0},
                           std::byte{0},
                           std::byte{0},
                           std::byte{5}};
  const auto read = decode<Wire::kCdr, Clock>(big);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->clock, clock.clock);
}

TEST(Wires, ALengthAloneTakesNoMemory) {
  // four thousand million points, poses, characters: none of them there
  std::vector<std::byte> bytes(64, std::byte{0xff});
  EXPECT_FALSE((decode<Wire::kRos1, PointCloud2>(bytes)));
  EXPECT_FALSE((decode<Wire::kRos1, Path>(bytes)));
  bytes[0] = bytes[2] = bytes[3] = std::byte{0};
  bytes[1] = std::byte{1};
  EXPECT_FALSE((decode<Wire::kCdr, MarkerArray>(bytes)));
  EXPECT_FALSE((decode<Wire::kCdr, Joy>(bytes)));
}

}  // namespace
}  // namespace pointflight::msg
