// Surveys read from recordings: clouds and poses of several kinds, as their makers send them.
#include "pointflight/recording/recorded_survey.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/recording/mcap_reader.hpp"
#include "pointflight/recording/mcap_writer.hpp"
#include "pointflight/recording/sqlite_reader.hpp"
#include "pointflight/ros/common/cloud_points.hpp"
#include "pointflight/ros/common/conversion.hpp"
#include "pointflight/ros/common/description.hpp"
#include "pointflight/ros/common/point_layout.hpp"
#include "tests/recording/database.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::TemporaryFolder;
using testing::write_file;

constexpr Duration kEpoch = std::chrono::seconds(1'700'000'000);
constexpr int kScans = 5;
const Pose kMount{quaternion_from_rpy(0.0, 0.3, 0.1), {0.1, 0.0, -0.05}};

/// The body flies along x with 1 m/s and turns; poses come each 20 ms.
Pose body_at(double t) {
  return {quaternion_from_rpy(0.0, 0.0, 0.5 * t), {t, 2.0, 1.5}};
}

/// What stands there.
const std::vector<Vector3d> kPlaces = {{6, 0, 0}, {6, 4, 1}, {-3, 2, 2}, {0.4, 7, 3}, {2, -5, 1}};

double time_of_place(std::size_t i) {
  return 0.02 * static_cast<double>(i);
}

/// A scan as a sensor that turns with the body has it: each position at a time of its own.
Scan scan_from(int number) {
  Scan scan;
  scan.start = SimTime(from_seconds(0.1 * number));
  scan.middle = scan.start + from_seconds(0.05);
  for (std::size_t i = 0; i < kPlaces.size(); ++i) {
    const Pose sensor = body_at(0.1 * number + time_of_place(i)) * kMount;
    ScanPoint& point = scan.points.emplace_back();
    point.position_sensor = (sensor.inverse() * kPlaces[i]).cast<float>();
    point.range = point.position_sensor.norm();
    point.intensity = 10.0f + static_cast<float>(i);
    point.time_offset = from_seconds(time_of_place(i));
  }
  return scan;
}

/// Messages by their topics, in the order in which they are added.
class Recorder {
 public:
  explicit Recorder(std::string path) : writer_(std::move(path), {"lz4", 3000}) {}

  template <class M>
  void add(const std::string& topic, const M& message, const char* type_package = nullptr) {
    MessageType type = message_type<M>();
    if (type_package != nullptr) type.ros2_package = type_package;
    const auto [at, is_new] = numbers_.try_emplace(topic, 0);
    if (is_new) at->second = writer_.advertise({topic, type});
    writer_.send(at->second,
                 std::make_shared<const std::vector<std::byte>>(encode<Wire::kCdr>(message)),
                 ++time_);
  }
  void close() { writer_.close(); }

 private:
  McapWriter writer_;
  std::map<std::string, int> numbers_;
  std::int64_t time_ = 0;
};

void add_odometry(Recorder& recorder,
                  const std::string& topic = "/odom",
                  int from = 0,
                  int to = 40) {
  for (int i = from; i < to; ++i) {
    const double t = 0.02 * i;
    msg::Odometry odometry;
    odometry.header = header_of(SimTime(from_seconds(t)), kEpoch, "map");
    odometry.child_frame_id = "base_link";
    odometry.pose.pose = pose_of(body_at(t));
    recorder.add(topic, odometry);
  }
}

void add_mount(Recorder& recorder) {
  // base_link -> mast -> lidar
  const Pose mast{quaternion_from_rpy(0.0, 0.0, 0.7), {0.0, 0.0, 0.3}};
  const msg::Header header = header_of(SimTime{}, kEpoch, "base_link");
  msg::Header on_mast = header;
  on_mast.frame_id = "/mast";
  recorder.add("/tf_static",
               msg::TFMessage{{transform_of(mast, header, "mast"),
                               transform_of(mast.inverse() * kMount, on_mast, "lidar")}});
}

RecordedSurvey survey_in(const std::string& path, RecordedSurveyOptions options = {}) {
  options.name = path;
  return {[path](const auto&) { return open_mcap({path}); }, options};
}

std::vector<SurveyRay> rays_of(const SurveySource& survey) {
  std::vector<SurveyRay> rays;
  std::vector<SurveyRay> batch;
  const auto reader = survey.open();
  while (reader->read(batch)) rays.insert(rays.end(), batch.begin(), batch.end());
  return rays;
}

/// Every ray ends at its position, to `tolerance`, and began at the sensor.
void expect_places(const std::vector<SurveyRay>& rays, double tolerance, bool deskewed = false) {
  ASSERT_EQ(rays.size(), kScans * kPlaces.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const std::size_t place = i % kPlaces.size();
    const double t =
        0.1 * static_cast<double>(i / kPlaces.size()) + (deskewed ? 0.0 : time_of_place(place));
    EXPECT_LT((rays[i].point_world() - kPlaces[place]).norm(), tolerance) << i;
    EXPECT_LT((rays[i].origin_world - (body_at(t) * kMount).translation).norm(), tolerance) << i;
    EXPECT_EQ(rays[i].intensity, 10.0f + static_cast<float>(place));
    EXPECT_TRUE(rays[i].is_return);
  }
}

TEST(RecordedSurvey, OfSqliteIsTheSameAsOfMcap) {
  const TemporaryFolder folder;
  Recorder recorder(folder / "a.mcap");
  add_mount(recorder);
  add_odometry(recorder);
  for (int i = 0; i < kScans; ++i) {
    recorder.add("/points", cloud_of(scan_from(i), point_layout("livox"), "lidar", kEpoch));
  }
  recorder.close();
  {
    testing::Database file(folder / "a.db3");
    file.make_tables();
    std::map<std::string, int> topics;
    const auto messages = open_mcap({folder / "a.mcap"});
    for (Recorded m; messages->next(m);) {
      const int number = static_cast<int>(topics.size()) + 1;
      const auto [at, is_new] = topics.try_emplace(std::string(m.topic), number);
      if (is_new) file.add_topic(number, std::string(m.topic), std::string(m.type));
      std::string hex;
      for (std::size_t i = 0; i < m.size; ++i) {
        hex += fmt::format("{:02x}", static_cast<unsigned>(m.data[i]));
      }
      file.add_message(at->second, m.time, hex);
    }
  }
  RecordedSurveyOptions options;
  options.name = folder / "a.db3";
  const RecordedSurvey survey(
      [&](const auto& topics) { return open_sqlite({folder / "a.db3"}, topics); }, options);
  expect_places(rays_of(survey), 1e-4);
}

TEST(RecordedSurvey, CloudsOfAllDriversWithTimesLieWhereTheyWere) {
  const TemporaryFolder folder;
  for (const char* layout : {"livox", "velodyne", "ouster", "hesai", "xyzit", "livox_custom"}) {
    const std::string path = folder / (std::string(layout) + ".mcap");
    Recorder recorder(path);
    add_mount(recorder);
    add_odometry(recorder);
    for (int i = 0; i < kScans; ++i) {
      if (std::string(layout) == kLivoxCustom) {
        recorder.add("/points", custom_cloud_of(scan_from(i), "lidar", kEpoch), "livox_interfaces");
      } else {
        recorder.add("/points", cloud_of(scan_from(i), point_layout(layout), "/lidar", kEpoch));
      }
    }
    recorder.close();
    const RecordedSurvey survey = survey_in(path);
    EXPECT_EQ(survey.scan_count(), static_cast<std::size_t>(kScans)) << layout;
    expect_contains(survey.about(), "/points (lidar), poses of /odom (base_link in map); 5 scans");
    EXPECT_TRUE(survey.open()->has_intensity());
    expect_places(rays_of(survey), 1e-4);
  }
}

TEST(RecordedSurvey, OnlyTheScansThatAreWantedAndThatThePosesReach) {
  const TemporaryFolder folder;
  Recorder recorder(folder / "a.mcap");
  add_mount(recorder);
  add_odometry(recorder, "/odom", 8, 40);  // from 0.16 s on
  for (int i = 0; i < kScans; ++i) {
    recorder.add("/points", cloud_of(scan_from(i), point_layout("xyzit"), "lidar", kEpoch));
  }
  recorder.close();
  const RecordedSurvey survey = survey_in(folder / "a.mcap");
  EXPECT_EQ(survey.scan_count(), 3u);
  expect_contains(survey.about(), "2 before the first or after the last pose left out");
  const auto reader = survey.open([](std::size_t scan) { return scan == 1; });
  std::vector<SurveyRay> batch;
  ASSERT_TRUE(reader->read(batch));
  EXPECT_NEAR(batch[0].origin_world.x(), (body_at(0.3) * kMount).translation.x(), 1e-6);
  EXPECT_FALSE(reader->read(batch));
}

TEST(RecordedSurvey, RegisteredCloudsStayWhereTheyAre) {
  const TemporaryFolder folder;
  Recorder recorder(folder / "fast_lio.mcap");
  add_odometry(recorder);
  for (int i = 0; i < kScans; ++i) {
    std::vector<Vector3f> points;
    std::vector<float> intensities;
    for (std::size_t k = 0; k < kPlaces.size(); ++k) {
      points.push_back(kPlaces[k].cast<float>());
      intensities.push_back(10.0f + static_cast<float>(k));
    }
    auto cloud = cloud_of_points(points, intensities, point_layout("xyzi"));
    cloud.header = header_of(SimTime(from_seconds(0.1 * i)), kEpoch, "map");
    recorder.add("/cloud_registered", cloud);
  }
  recorder.close();
  RecordedSurveyOptions options;
  options.T_pose_sensor = kMount;
  expect_places(rays_of(survey_in(folder / "fast_lio.mcap", options)), 1e-5, true);
}

TEST(RecordedSurvey, PosesFromAFileAndSensorsWithAClockOfTheirOwn) {
  const TemporaryFolder folder;
  Recorder recorder(folder / "a.mcap");
  add_odometry(recorder);
  for (int i = 0; i < kScans; ++i) {
    auto cloud = cloud_of(scan_from(i), point_layout("livox"), "lidar", Duration{0});
    cloud.header = header_of(scan_from(i).start, kEpoch, "lidar");
    // since it was switched on, an hour ago
    for (std::size_t k = 0; k < kPlaces.size(); ++k) {
      const double ns = 3.6e12 + 1e9 * (0.1 * i + time_of_place(k));
      std::memcpy(cloud.data.data() + k * cloud.point_step + 18, &ns, sizeof ns);
    }
    recorder.add("/points", cloud);
  }
  recorder.close();
  std::string poses;
  for (int i = 0; i < 40; ++i) {
    const Pose pose = body_at(0.02 * i) * kMount;
    const Quaterniond& q = pose.rotation;
    poses += fmt::format("{:.3f} {} {} {} {} {} {} {}\n",
                         1.7e9 + 0.02 * i,
                         pose.translation.x(),
                         pose.translation.y(),
                         pose.translation.z(),
                         q.x(),
                         q.y(),
                         q.z(),
                         q.w());
  }
  write_file(folder / "poses.tum", poses);
  RecordedSurveyOptions options;
  options.poses = folder / "poses.tum";
  expect_places(rays_of(survey_in(folder / "a.mcap", options)), 1e-4);
}

TEST(RecordedSurvey, WhatIsMissingOrAmbiguousIsSaid) {
  const TemporaryFolder folder;
  const auto error_in = [&](const RecordedSurveyOptions& options,
                            const std::function<void(Recorder&)>& fill) {
    Recorder recorder(folder / "x.mcap");
    fill(recorder);
    recorder.close();
    const std::string error = error_of([&] { survey_in(folder / "x.mcap", options); });
    EXPECT_EQ(error.find('\n'), std::string::npos);
    return error;
  };
  const auto cloud = [](const std::string& frame) {
    return cloud_of(scan_from(1), point_layout("xyzit"), frame, kEpoch);
  };
  expect_contains(error_in({}, [](Recorder& r) { add_odometry(r); }), "has no clouds");
  expect_contains(error_in({}, [&](Recorder& r) { r.add("/a", cloud("lidar")); }), "has no poses");
  const auto two = [&](Recorder& r) {
    add_odometry(r);
    r.add("/a", cloud("lidar"));
    r.add("/b", cloud("lidar"));
  };
  expect_contains(error_in({}, two), "several topics: /a, /b; choose one by --scan-topic");
  RecordedSurveyOptions options;
  options.cloud_topic = "/c";
  expect_contains(error_in(options, two), "on /c; there are: /a, /b");
  options.cloud_topic = "/b";
  expect_contains(error_in(options, two), "give --sensor-pose");
  const auto late = [&](Recorder& r) {
    add_mount(r);
    add_odometry(r, "/odom", 30, 40);
    r.add("/a", cloud("lidar"));
  };
  expect_contains(error_in({}, late), "within the poses");
  write_file(folder / "kitti.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  options = {};
  options.poses = folder / "kitti.txt";
  expect_contains(error_in(options, late), "have no times");
  const auto broken = [&](Recorder& r) {
    add_odometry(r);
    auto short_one = cloud("lidar");
    short_one.data.resize(10);
    r.add("/a", short_one);
  };
  expect_contains(error_in({}, broken),
                  "a cloud on /a: 5 x 1 points of 22 bytes are not in its 10");
}

TEST(CloudPoints, RowsOfAnyStrideAndNumbersOfAnyType) {
  msg::PointCloud2 cloud;
  cloud.height = 2;
  cloud.width = 2;
  cloud.point_step = 20;
  cloud.row_step = 50;
  cloud.data.resize(90);  // the last row without what fills it up
  using Type = msg::PointField;
  cloud.point_fields = {{"z", 0, Type::INT16, 1},
                        {"y", 2, Type::FLOAT64, 1},
                        {"x", 10, Type::FLOAT32, 1},
                        {"reflectivity", 14, Type::UINT8, 1},
                        {"t", 15, Type::UINT32, 1}};
  for (std::size_t i = 0; i < 4; ++i) {
    std::uint8_t* at = cloud.data.data() + i / 2 * 50 + i % 2 * 20;
    const auto z = static_cast<std::int16_t>(-5 - static_cast<int>(i));
    const double y = 0.5 * static_cast<double>(i);
    const float x = 7.0f;
    const std::uint32_t t = 1000 * static_cast<std::uint32_t>(i);
    std::memcpy(at, &z, 2);
    std::memcpy(at + 2, &y, 8);
    std::memcpy(at + 10, &x, 4);
    at[14] = 200;
    std::memcpy(at + 15, &t, 4);
  }
  const CloudMessagePoints found = points_of(cloud);
  ASSERT_EQ(found.points.size(), 4u);
  EXPECT_EQ(found.points[3].position, Vector3d(7.0, 1.5, -8.0));
  EXPECT_EQ(found.points[3].intensity, 200.0f);
  EXPECT_DOUBLE_EQ(found.points[3].time, 3e-6);
  EXPECT_TRUE(found.has_intensity);
  cloud.row_step = 39;
  expect_contains(error_of([&] { points_of(cloud); }), "are not in its 90 bytes");
  cloud.row_step = 50;
  cloud.point_fields[4].offset = 17;
  expect_contains(error_of([&] { points_of(cloud); }), "'t' does not lie within a point");
  cloud.point_fields.erase(cloud.point_fields.begin() + 2);
  cloud.point_fields[3].offset = 15;
  expect_contains(error_of([&] { points_of(cloud); }), "no fields x, y, z");
}

}  // namespace
}  // namespace pointflight
