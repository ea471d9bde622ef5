#include <gtest/gtest.h>

#include <string>

#include "pointflight/lidar/vendor_files.hpp"
#include "tests/lidar/scan_of.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::angles_of;
using testing::error_of;
using testing::expect_contains;
using testing::scan_of;
using testing::TemporaryFolder;

/// A unit of four beams, in the flat layout of old firmware or in sections.
std::string metadata_of(bool in_sections) {
  const std::string beams =
      "\"beam_altitude_angles\": [10, 3, -3, -10], \"beam_azimuth_angles\": [3.1, 1, -1, -3], "
      "\"lidar_origin_to_beam_origin_mm\": 15.8";
  const std::string frame =
      "\"lidar_to_sensor_transform\": [-1,0,0,0, 0,-1,0,0, 0,0,1,36.18, 0,0,0,1]";
  const std::string unit = "\"prod_line\": \"OS-1-4\"";
  const std::string mode = "\"lidar_mode\": \"512x20\"";
  if (!in_sections) return "{" + beams + ", " + frame + ", " + unit + ", " + mode + "}";
  return "{\"beam_intrinsics\": {" + beams + "}, \"lidar_intrinsics\": {" + frame +
         "}, \"sensor_info\": {" + unit + "}, \"config_params\": {" + mode + "}}";
}

TEST(MakerFiles, OustersMetadataIsASensor) {
  for (const bool in_sections : {false, true}) {
    const TemporaryFolder folder;
    testing::write_file(folder / "unit.json", metadata_of(in_sections));
    const LidarSettings s = load_lidar(folder / "unit.json");
    EXPECT_EQ(s.rate, 20.0);
    EXPECT_EQ(s.detection.rated, load_lidar("os1_128").detection.rated);
    const auto beams = scan_of(folder / "unit.json");
    ASSERT_EQ(beams.size(), 512u * 4u);
    EXPECT_NEAR(angles_of(beams[0]).elevation_deg, 10.0, 1e-4);
    EXPECT_EQ(beams[3].ring, 3);
    EXPECT_NEAR(beams[0].origin_sensor.z(), 0.03618f, 1e-6f);
    EXPECT_NEAR(beams[0].origin_sensor.head<2>().norm(), 0.0158f, 1e-6f);
    // the same as a sensor file with these figures
    const auto same = parse_lidar(
        "range_max: 100\nrate: 20\npattern: rings\nrings: {convention: ouster, columns: 512, "
        "beam_origin_radius: 0.0158, origin_z: 0.03618, elevations_deg: [10, 3, -3, -10], "
        "azimuth_offsets_deg: [3.1, 1, -1, -3]}\n",
        "x.yaml");
    const auto written = make_pattern(same)->beams(0, Executor(1));
    ASSERT_EQ(written.size(), beams.size());
    EXPECT_EQ(written[777].direction_sensor, beams[777].direction_sensor);
  }
}

TEST(MakerFiles, WrongOnesSayWhat) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& from, const std::string& to) {
    std::string text = metadata_of(false);
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos);
    text.replace(at, from.size(), to);
    return error_of([&] { parse_ouster_metadata(text, "unit.json"); });
  };
  expect_contains(error("512x20", "fast"), "unit.json: lidar_mode: 'fast' is no mode");
  expect_contains(error("512x20", "512abcx20"), "'512abcx20' is no mode");
  expect_contains(error("512x20", "512x20Hz"), "'512x20Hz' is no mode");
  expect_contains(error("OS-1-4", "XT-32"), "unit.json: prod_line: 'XT-32' is none of");
  expect_contains(error("[3.1, 1", "[1"), "4 of these and 3 beam_azimuth_angles");
  expect_contains(error("15.8", "\"near\""), "lidar_origin_to_beam_origin_mm: a number is wanted");
  expect_contains(error("{", "[{"), "unit.json: this is no JSON object");
  testing::write_file(folder / "few.csv", "Time/s,Azimuth/deg,Zenith/deg\n1,0,90\n");
  expect_contains(error_of([&] { load_lidar(folder / "few.csv"); }),
                  "1 rows are no 4 s of a Livox");
}

TEST(MakerFiles, ALivoxTableIsASensor) {
  const TemporaryFolder folder;
  std::string text = "Time/s,Azimuth/deg,Zenith/deg\n";
  for (int i = 0; i < 400000; ++i) text += i % 2 == 0 ? "1,0,90\n" : "2,5,85\n";
  testing::write_file(folder / "mid70.csv", text);
  std::string wrong = text;
  wrong.replace(wrong.find("2,5,85"), 6, "2,1e300,85");
  testing::write_file(folder / "wrong.csv", wrong);
  expect_contains(error_of([&] { static_cast<void>(scan_of(folder / "wrong.csv")); }),
                  "wrong.csv:3: (1e+300, 5) is no azimuth and elevation");
  wrong.replace(wrong.find("2,1e300,85"), 10, "2,5,200");
  testing::write_file(folder / "wrong.csv", wrong);
  expect_contains(error_of([&] { static_cast<void>(scan_of(folder / "wrong.csv")); }),
                  "(5, -110) is no azimuth and elevation");
  const LidarSettings s = load_lidar(folder / "mid70.csv");
  EXPECT_EQ(s.csv.points_per_second, 100000.0);
  EXPECT_EQ(s.range_max, load_lidar("mid40").range_max);
  const auto beams = scan_of(folder / "mid70.csv");
  ASSERT_EQ(beams.size(), 10000u);
  EXPECT_NEAR(angles_of(beams[1]).elevation_deg, 5.0, 1e-4);
}

}  // namespace
}  // namespace pointflight
