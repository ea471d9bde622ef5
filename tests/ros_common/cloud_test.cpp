// What the points of each layout say, read back by field name and type as a subscriber would.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "pointflight/core/input_error.hpp"
#include "pointflight/ros/common/cloud_points.hpp"
#include "pointflight/ros/common/point_layout.hpp"
#include "pointflight/ros/common/profile.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;

constexpr Duration kCloudEpoch = std::chrono::seconds(1'700'000'000);

/// Three points of a scan that starts at 2 s.
Scan scan_of_three() {
  Scan scan;
  scan.start = SimTime(std::chrono::seconds(2));
  scan.end = scan.start + std::chrono::milliseconds(100);
  scan.middle = scan.start + std::chrono::milliseconds(50);
  scan.beams = 4;
  for (int i = 0; i < 3; ++i) {
    ScanPoint p{};
    const auto k = static_cast<float>(i);
    p.position_sensor = {1.0f + k, -2.0f, 0.25f * k};
    p.range = p.position_sensor.norm();
    p.intensity = 100.0f + 100.0f * k;
    p.time_offset = std::chrono::microseconds(500 + 40000 * i);
    p.ring = static_cast<std::uint16_t>(i);
    p.is_unknown = i == 1;
    scan.points.push_back(p);
  }
  return scan;
}

/// Value of a field of point i, by its name; NaN if there is no such field.
double value_of(const msg::PointCloud2& cloud, std::size_t i, const std::string& name) {
  for (const msg::PointField& field : cloud.point_fields) {
    if (field.name != name) continue;
    const std::uint8_t* at = cloud.data.data() + i * cloud.point_step + field.offset;
    const auto as = [&]<class T>(T value) {
      std::memcpy(&value, at, sizeof(T));
      return static_cast<double>(value);
    };
    switch (field.datatype) {
      case msg::PointField::UINT8:
        return as(std::uint8_t{});
      case msg::PointField::UINT16:
        return as(std::uint16_t{});
      case msg::PointField::UINT32:
        return as(std::uint32_t{});
      case msg::PointField::FLOAT32:
        return as(float{});
      case msg::PointField::FLOAT64:
        return as(double{});
      default:
        break;
    }
  }
  return std::nan("");
}

TEST(PointLayouts, FieldsLieWhereDriversPutThem) {
  const auto text = [](const char* name) {
    const PointLayout& layout = point_layout(name);
    std::string line;
    for (const auto& field : layout.fields) {
      line += std::string(field.name) + ":" + std::to_string(field.type) + "@" +
              std::to_string(field.offset) + " ";
    }
    return line + std::to_string(layout.step);
  };
  EXPECT_EQ(text("livox"), "x:7@0 y:7@4 z:7@8 intensity:7@12 tag:2@16 line:2@17 timestamp:8@18 26");
  EXPECT_EQ(text("velodyne"), "x:7@0 y:7@4 z:7@8 intensity:7@12 ring:4@16 time:7@18 22");
  EXPECT_EQ(text("velodyne_padded"), "x:7@0 y:7@4 z:7@8 intensity:7@16 ring:4@20 time:7@24 32");
  EXPECT_EQ(text("ouster"),
            "x:7@0 y:7@4 z:7@8 intensity:7@16 t:6@20 reflectivity:4@24 ring:2@26 ambient:4@28 "
            "range:6@32 48");
  EXPECT_EQ(text("hesai"), "x:7@0 y:7@4 z:7@8 intensity:7@16 timestamp:8@24 ring:4@32 48");
  EXPECT_EQ(text("xyzi"), "x:7@0 y:7@4 z:7@8 intensity:7@12 16");
  EXPECT_EQ(text("xyzi_padded"), "x:7@0 y:7@4 z:7@8 intensity:7@16 32");
  EXPECT_EQ(text("xyzi_unknown"), "x:7@0 y:7@4 z:7@8 intensity:7@12 unknown:2@16 17");
  EXPECT_EQ(text("xyzit_unknown"),
            "x:7@0 y:7@4 z:7@8 intensity:7@12 t:6@16 ring:4@20 unknown:2@22 23");
  EXPECT_EQ(text("xyz_padded"), "x:7@0 y:7@4 z:7@8 16");
  expect_contains(error_of([] { point_layout("velo"); }), "velodyne_padded");
}

TEST(PointLayouts, HoldTheScan) {
  const Scan scan = scan_of_three();
  for (const PointLayout& layout : point_layouts()) {
    const msg::PointCloud2 cloud = cloud_of(scan, layout, "sensor", kCloudEpoch);
    EXPECT_EQ(cloud.height, 1u);
    EXPECT_EQ(cloud.width, 3u);
    EXPECT_TRUE(cloud.is_dense);
    EXPECT_EQ(cloud.row_step, 3 * cloud.point_step);
    EXPECT_EQ(cloud.data.size(), cloud.row_step);
    EXPECT_EQ(cloud.header.frame_id, "sensor");
    // stamped with the first point, or with the scan's middle if points have no time
    EXPECT_EQ(cloud.header.stamp.sec, 1'700'000'002) << layout.name;
    EXPECT_EQ(cloud.header.stamp.nanosec, layout.timed ? 500'000u : 50'000'000u) << layout.name;
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(value_of(cloud, i, "x"), 1.0 + static_cast<double>(i));
      EXPECT_EQ(value_of(cloud, i, "y"), -2.0);
      const auto or_absent = [&](const char* name, double expected, double tolerance) {
        const double value = value_of(cloud, i, name);
        if (std::isnan(value)) return;
        EXPECT_NEAR(value, expected, tolerance) << layout.name << name;
      };
      const double intensity = 100.0 + 100.0 * static_cast<double>(i);
      const double after = 0.04 * static_cast<double>(i);
      or_absent("intensity", intensity, 0.0);
      or_absent("ring", static_cast<double>(i), 0.0);
      or_absent("unknown", i == 1 ? 1.0 : 0.0, 0.0);
      or_absent("line", static_cast<double>(i), 0.0);
      or_absent("tag", 16.0, 0.0);
      or_absent("time", after, 1e-8);
      or_absent("t", 1e9 * after, 0.0);
      or_absent("range", std::round(1e3 * static_cast<double>(scan.points[i].range)), 0.0);
      const double absolute = 1'700'000'002.0005 + after;
      if (std::string(layout.name) == "livox") or_absent("timestamp", 1e9 * absolute, 300.0);
      if (std::string(layout.name) == "hesai") or_absent("timestamp", absolute, 1e-6);
    }
  }
}

TEST(PointLayouts, ReturnsWithoutAnIntensityGetAPlainOne) {
  Scan scan = scan_of_three();
  scan.points[1].intensity = 0.0f;
  for (const PointLayout& layout : point_layouts()) {
    const auto cloud = cloud_of(scan, layout, "sensor", kCloudEpoch, {}, kPlainIntensity);
    for (const char* name : {"intensity", "reflectivity"}) {
      const double value = value_of(cloud, 1, name);
      EXPECT_TRUE(std::isnan(value) || value == kPlainIntensity) << layout.name << " " << name;
      const double other = value_of(cloud, 0, name);
      EXPECT_TRUE(std::isnan(other) || other == 100.0) << layout.name << " " << name;
    }
  }
  const auto custom = custom_cloud_of(scan, "livox_frame", kCloudEpoch, kPlainIntensity);
  EXPECT_EQ(custom.points[1].reflectivity, 45);
  EXPECT_EQ(custom.points[0].reflectivity, 100);
}

TEST(PointLayouts, LivoxCustomCountsFromItsFirstPoint) {
  const Scan scan = scan_of_three();
  const msg::CustomMsg cloud = custom_cloud_of(scan, "livox_frame", kCloudEpoch);
  EXPECT_EQ(cloud.timebase, 1'700'000'002'000'500'000u);
  EXPECT_EQ(cloud.header.stamp.nanosec, 500'000u);
  ASSERT_EQ(cloud.point_num, 3u);
  EXPECT_EQ(cloud.points[0].offset_time, 0u);
  EXPECT_EQ(cloud.points[2].offset_time, 80'000'000u);
  EXPECT_EQ(cloud.points[2].line, 2);
  EXPECT_EQ(cloud.points[2].reflectivity, 255);  // 300 does not fit
  EXPECT_EQ(cloud.points[1].tag & 0x30, 0x10);
}

TEST(PointLayouts, AScanWithoutPointsIsACloudWithoutPoints) {
  Scan scan = scan_of_three();
  scan.points.clear();
  const msg::PointCloud2 cloud = cloud_of(scan, point_layout("velodyne"), "s", kCloudEpoch);
  EXPECT_EQ(cloud.width, 0u);
  EXPECT_TRUE(cloud.data.empty());
  EXPECT_EQ(cloud.header.stamp.nanosec, 0u);
  EXPECT_EQ(custom_cloud_of(scan, "s", kCloudEpoch).point_num, 0u);
}

TEST(Profiles, ShippedOnesAreReadAndMistakesSayWhere) {
  for (const char* name : {"default",
                           "marsim",
                           "marsim-fuel",
                           "super",
                           "ego",
                           "fuel",
                           "racer",
                           "livox",
                           "velodyne",
                           "ouster"}) {
    EXPECT_FALSE(load_ros_profile(name).outputs.empty()) << name;
  }
  expect_contains(error_of([] { load_ros_profile("marsin"); }), "marsim");
  const auto error = [](const char* text) {
    return error_of([&] { parse_ros_profile(text, "p.yaml"); });
  };
  expect_contains(error("outputs:\n  - {kind: odometri, topic: /o}\n"), "p.yaml:2");
  expect_contains(error("outputs:\n  - {kind: cloud, topic: /c, layout: liwox}\n"), "p.yaml:2");
  expect_contains(error("inputs:\n  - {kind: goal, topci: /c}\n"), "topic");
  EXPECT_EQ(with_names("/{vehicle}/{lidar}_{id}{x}", {"a", 3, "b"}), "/a/b_3{x}");
}

TEST(CloudPoints, MoreThanAnyScanHasAreRefused) {
  msg::PointCloud2 cloud;
  // all fields lie on each other: bytes alone do not bound the points
  for (const char* name : {"x", "y", "z"}) {
    cloud.point_fields.push_back({name, 0, msg::PointField::FLOAT32, 1});
  }
  cloud.width = 25'000'000;
  cloud.height = 1;
  cloud.point_step = 4;
  cloud.row_step = cloud.width * cloud.point_step;
  cloud.data.resize(cloud.row_step);
  expect_contains(error_of([&] { static_cast<void>(points_of(cloud)); }),
                  "more than any scan has (20 million)");
}

}  // namespace
}  // namespace pointflight
