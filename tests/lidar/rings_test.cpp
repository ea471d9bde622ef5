// Spinning sensors: channels, tables, firing times.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <set>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/io/csv_table.hpp"
#include "pointflight/lidar/beam_pattern.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "tests/lidar/scan_of.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::angles_of;
using testing::error_of;
using testing::expect_contains;
using testing::scan_of;
using testing::TemporaryFolder;

TEST(Rings, ACopiedFileFindsItsTableByPathOrName) {
  const auto shipped = scan_of("vlp32c");
  const TemporaryFolder folder;
  const std::string text = testing::read_file(data_folder() + "/lidars/vlp32c.yaml");
  const std::size_t at = text.find("tables/velodyne_vlp32c.csv");
  ASSERT_NE(at, std::string::npos);
  for (const char* name :
       {"tables/velodyne_vlp32c.csv", "velodyne_vlp32c.csv", "velodyne_vlp32c"}) {
    std::string mine = text;
    mine.replace(at, std::string("tables/velodyne_vlp32c.csv").size(), name);
    testing::write_file(folder / "my32.yaml", mine);
    const auto beams = scan_of(folder / "my32.yaml");
    ASSERT_EQ(beams.size(), shipped.size()) << name;
    EXPECT_EQ(beams[77].direction_sensor, shipped[77].direction_sensor);
  }
  // a table beside the file goes before the shipped one
  testing::write_file(folder / "velodyne_vlp32c", "ring,elevation_deg,azimuth_offset_deg\n0,5,0\n");
  EXPECT_LT(scan_of(folder / "my32.yaml").size(), shipped.size() / 30);
}

TEST(Rings, ChannelsWithoutATable) {
  const auto beams_of = [](const std::string& rings) {
    const Executor executor(1);
    return make_pattern(parse_lidar("range_max: 10\npattern: rings\nrings: " + rings, "x.yaml"))
        ->beams(0, executor);
  };
  // in the order of firing, rings counted from below
  const auto listed = beams_of(
      "{elevations_deg: [-4, 6, 1], azimuth_offsets_deg: [0, 2, -3], cycle_us: 100, "
      "channel_interval_us: 10}\n");
  ASSERT_GE(listed.size(), 3u * 999u);
  const double elevations[] = {-4, 6, 1};
  const double offsets[] = {0, 2, -3};
  const int rings[] = {0, 2, 1};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(angles_of(listed[i]).elevation_deg, elevations[i], 1e-4);
    // the head turns clockwise by 0.36 deg in 100 us and the channel lags by its offset
    EXPECT_NEAR(
        angles_of(listed[i]).azimuth_deg, offsets[i] - 0.036 * static_cast<double>(i), 1e-4);
    EXPECT_EQ(listed[i].ring, rings[i]);
    EXPECT_EQ(listed[i].time_offset, Duration(10000 * static_cast<std::int64_t>(i)));
  }
  const auto spaced = beams_of("{channels: 5, elevation_min_deg: -10, elevation_max_deg: 30}\n");
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(angles_of(spaced[i]).elevation_deg, -10.0 + 10.0 * static_cast<double>(i), 1e-4);
  }
  const auto columns = beams_of("{convention: ouster, channels: 3, columns: 16}\n");
  ASSERT_EQ(columns.size(), 48u);
  std::set<std::uint16_t> numbers;
  for (std::size_t i = 0; i < 3; ++i) {  // rows from the top
    EXPECT_NEAR(angles_of(columns[i]).elevation_deg, 15.0 - 15.0 * static_cast<double>(i), 1e-4);
    numbers.insert(columns[i].ring);
  }
  EXPECT_EQ(numbers, (std::set<std::uint16_t>{0, 1, 2}));
  const auto error = [&](const std::string& text) { return error_of([&] { beams_of(text); }); };
  expect_contains(error("{elevations_deg: [1, 2], azimuth_offsets_deg: [1]}\n"),
                  "1 offsets for 2 elevations");
  expect_contains(error("{channels: 3, elevation_min_deg: 5, elevation_max_deg: 5}\n"),
                  "is not below elevation_max_deg");
}

/// Fields of view and points per second as the data sheets have them.
TEST(Rings, ShippedSensorsHaveTheirSheetsFigures) {
  struct Case {
    const char* name;
    int rings;
    double low_deg, high_deg;
    double points_per_second;
  };
  const Case cases[] = {
      {"vlp16", 16, -15.0, 15.0, 289e3},      {"vlp16_hires", 16, -10.0, 10.0, 289e3},
      {"vlp32c", 32, -25.0, 15.0, 579e3},     {"hdl32e", 32, -30.67, 10.67, 694e3},
      {"hdl64e", 64, -24.8, 5.0, 1.333e6},    {"hdl64e_s3", 64, -24.8, 2.0, 1.333e6},
      {"vls128", 128, -25.0, 15.0, 2.4e6},    {"xt16", 16, -15.0, 15.0, 320e3},
      {"xt32", 32, -16.0, 15.0, 640e3},       {"xt32m2x", 32, -20.8, 19.5, 640e3},
      {"qt64", 64, -52.1, 52.1, 384e3},       {"pandar40p", 40, -25.0, 15.0, 720e3},
      {"pandar64", 64, -25.0, 15.0, 1.152e6}, {"os0_32", 32, -45.0, 45.0, 328e3},
      {"os0_64", 64, -45.0, 45.0, 655e3},     {"os0_128", 128, -45.0, 45.0, 1.31e6},
      {"os1_32", 32, -20.5, 20.5, 328e3},     {"os1_32_gradient", 32, -15.3, 13.0, 328e3},
      {"os1_64", 64, -16.6, 16.6, 655e3},     {"os1_128", 128, -21.2, 21.2, 1.31e6},
      {"os2_128", 128, -11.25, 11.25, 1.31e6}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    const auto beams = scan_of(c.name, 1);
    EXPECT_NEAR(
        static_cast<double>(beams.size()) * 10.0, c.points_per_second, 0.005 * c.points_per_second);
    std::set<int> rings;
    double low = 90.0;
    double high = -90.0;
    std::vector<double> azimuths;
    for (const Beam& beam : beams) {
      rings.insert(beam.ring);
      low = std::min(low, angles_of(beam).elevation_deg);
      high = std::max(high, angles_of(beam).elevation_deg);
      azimuths.push_back(angles_of(beam).azimuth_deg);
    }
    EXPECT_EQ(static_cast<int>(rings.size()), c.rings);
    EXPECT_EQ(*rings.rbegin(), c.rings - 1);
    EXPECT_NEAR(low, c.low_deg, 1.5);  // units differ from sheets and from one another
    EXPECT_NEAR(high, c.high_deg, 1.5);
    std::sort(azimuths.begin(), azimuths.end());
    double gap = azimuths.front() + 360.0 - azimuths.back();
    for (std::size_t i = 1; i < azimuths.size(); ++i) {
      gap = std::max(gap, azimuths[i] - azimuths[i - 1]);
    }
    EXPECT_LT(gap, 1.0);  // a whole turn
  }
}

TEST(Hesai, ChannelsLeadByTheirAzimuthAndFireAtTheirTimes) {
  // channel 1 of the table, ring 0 in the maker's driver, fires 6 us into its block at 15 degrees
  const auto beams = scan_of("xt32");
  ASSERT_EQ(beams[0].time_offset, Duration(6000));
  EXPECT_NEAR(angles_of(beams[0]).elevation_deg, 15.0, 1e-4);
  EXPECT_EQ(beams[0].ring, 0);
  EXPECT_NEAR(angles_of(beams[0]).azimuth_deg, -3600.0 * 6e-6, 1e-4);  // clockwise
  EXPECT_EQ(beams[1].time_offset, Duration(7512));
  EXPECT_EQ(beams[1].ring, 1);
  // the first channel of a QT64 stands 8.736 degrees clockwise of the encoder
  const auto wide = scan_of("qt64");
  EXPECT_NEAR(angles_of(wide[0]).azimuth_deg, -8.736 - 3600.0 * 2.31e-6, 1e-4);
}

TEST(Ouster, ColumnsShareATimeAndBeamsLeaveTheRing) {
  for (const auto& [name, rows] : {std::pair("os1_32", 32u), std::pair("os1_128", 128u)}) {
    SCOPED_TRACE(name);
    const auto beams = scan_of(name);
    ASSERT_EQ(beams.size(), rows * 1024u);
    // row 0 is the highest, as in ouster_ros
    EXPECT_EQ(beams[0].ring, 0);
    for (std::size_t row = 1; row < rows; ++row) {
      ASSERT_EQ(beams[row].ring, row);
      ASSERT_LT(beams[row].direction_sensor.z(), beams[row - 1].direction_sensor.z());
    }
    EXPECT_EQ(beams[rows - 1].time_offset, beams[0].time_offset);
    EXPECT_EQ(beams[rows].time_offset, Duration(97656));
    EXPECT_NEAR(beams[0].origin_sensor.head<2>().norm(), 0.015806f, 1e-6f);
    EXPECT_NEAR(beams[0].origin_sensor.z(), 0.03618f, 1e-6f);
    // clockwise: the next column lies at a smaller azimuth, a 1024th of a turn on
    const double step = angles_of(beams[rows]).azimuth_deg - angles_of(beams[0]).azimuth_deg;
    EXPECT_NEAR(std::remainder(step, 360.0), -360.0 / 1024, 1e-3);
  }
  double high = -90;
  for (const Beam& beam : scan_of("os1_128")) high = std::max(high, angles_of(beam).elevation_deg);
  EXPECT_NEAR(high, 20.95, 1e-3);
}

}  // namespace
}  // namespace pointflight
