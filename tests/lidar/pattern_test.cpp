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

using testing::Angles;
using testing::angles_of;
using testing::error_of;
using testing::expect_contains;
using testing::scan_of;
using testing::shared_data;
using testing::TemporaryFolder;

double angle_between_deg(const Vector3d& a, const Vector3d& b) {
  return 2.0 * std::asin(std::min(1.0, 0.5 * (a - b).norm())) / kDegree;
}

/// Share of 0.2 deg cells (azimuth x elevation) that the scans up to `scans` hit.
double coverage(const std::string& name, int scans, double el_low, double el_high) {
  const Executor executor(2);
  const auto pattern = make_pattern(load_lidar(name));
  std::set<std::pair<int, int>> cells;
  for (int k = 0; k < scans; ++k) {
    for (const Beam& beam : pattern->beams(static_cast<std::uint64_t>(k), executor)) {
      const Angles a = angles_of(beam);
      if (a.elevation_deg < el_low || a.elevation_deg >= el_high) continue;
      cells.emplace(static_cast<int>(std::floor((a.azimuth_deg + 180.0) / 0.2)) % 1800,
                    static_cast<int>(std::floor((a.elevation_deg - el_low) / 0.2)));
    }
  }
  return static_cast<double>(cells.size()) / (1800.0 * (el_high - el_low) / 0.2);
}

std::vector<std::int16_t> load_npy(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  file.seekg(128);
  std::vector<std::int16_t> values(800000);
  file.read(reinterpret_cast<char*>(values.data()), 1600000);
  return values;
}

TEST(Mid360, MatchesThePublishedTable) {
  const std::string path = shared_data("scan_patterns/mid360_table_0s_2s_cdeg.npy");
  SKIP_WITHOUT(path);
  const auto table = load_npy(path);
  const Executor executor(2);
  const auto pattern = make_pattern(load_lidar("mid360"));
  double worst = 0.0;
  double sum = 0.0;
  std::size_t row = 0;
  for (std::uint64_t scan = 0; scan < 20; ++scan) {
    for (const Beam& beam : pattern->beams(scan, executor)) {
      const Vector3d truth =
          direction_of(table[2 * row] * 0.01 * kDegree, table[2 * row + 1] * 0.01 * kDegree);
      const double error = angle_between_deg(truth, beam.direction_sensor.cast<double>());
      worst = std::max(worst, error);
      sum += error;
      ++row;
    }
  }
  ASSERT_EQ(row, 400000u);
  EXPECT_LE(sum / 400000.0, 0.0049);
  EXPECT_LE(worst, 0.015);
}

TEST(Mid360, HasTheDataSheetsRateLinesAndFieldOfView) {
  const auto beams = scan_of("mid360");
  EXPECT_EQ(beams.size(), 20000u);
  double low = 90;
  double high = -90;
  for (std::size_t i = 0; i < beams.size(); ++i) {
    const Angles a = angles_of(beams[i]);
    low = std::min(low, a.elevation_deg);
    high = std::max(high, a.elevation_deg);
    EXPECT_EQ(beams[i].ring, i % 4);
    EXPECT_NEAR(beams[i].direction_sensor.norm(), 1.0f, 1e-6f);
  }
  EXPECT_NEAR(low, -7.2, 0.1);
  EXPECT_NEAR(high, 52.1, 0.1);
  EXPECT_EQ(beams[4].time_offset - beams[0].time_offset, Duration(20000));
}

TEST(Mid360, CoversAsTheRealOneDoes) {
  EXPECT_NEAR(coverage("mid360", 1, -7.0, 52.0), 0.0371, 0.001);
  EXPECT_NEAR(coverage("mid360", 5, -7.0, 52.0), 0.1706, 0.001);
  EXPECT_NEAR(coverage("mid360", 10, -7.0, 52.0), 0.3089, 0.001);
}

TEST(Mid360, HasNoSeamAfterTheTablesFourSeconds) {
  const auto before = scan_of("mid360", 39);
  const auto after = scan_of("mid360", 40);
  const auto step = [](const Beam& a, const Beam& b) {
    return angle_between_deg(a.direction_sensor.cast<double>(), b.direction_sensor.cast<double>());
  };
  double usual = 0.0;
  for (std::size_t i = 0; i + 4 < before.size(); i += 4) {
    usual = std::max(usual, step(before[i], before[i + 4]));
  }
  EXPECT_LE(step(before[before.size() - 4], after[0]), usual * 1.001);
}

TEST(Avia, MatchesTheGeneratedReference) {
  const std::string path = shared_data("scan_patterns/avia_generated_first_20ms.csv");
  SKIP_WITHOUT(path);
  // the file has no line of names
  const CsvTable table("time,line,azimuth,elevation\n" + testing::read_file(path), path);
  const auto beams = scan_of("avia");
  ASSERT_EQ(beams.size(), 24000u);
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const Vector3d truth = direction_of(table.at(row, table.require("azimuth")) * kDegree,
                                        table.at(row, table.require("elevation")) * kDegree);
    ASSERT_LT(angle_between_deg(truth, beams[row].direction_sensor.cast<double>()), 2e-5) << row;
    ASSERT_EQ(beams[row].ring, static_cast<int>(table.at(row, table.require("line"))));
    ASSERT_NEAR(to_seconds(beams[row].time_offset), table.at(row, table.require("time")), 1e-9);
  }
}

TEST(Avia, HasTheDataSheetsFieldOfView) {
  double az = 0.0;
  double el = 0.0;
  for (std::uint64_t k = 0; k < 10; ++k) {
    for (const Beam& beam : scan_of("avia", k)) {
      az = std::max(az, std::abs(angles_of(beam).azimuth_deg));
      el = std::max(el, std::abs(angles_of(beam).elevation_deg));
    }
  }
  EXPECT_NEAR(az, 35.2, 0.3);  // 70.4 x 77.2 deg
  EXPECT_NEAR(el, 38.6, 0.3);
}

TEST(Prisms, Mid40AndMid70MatchTheirTables) {
  const std::string path = shared_data("scan_patterns/mid40_table_0s_1s_1e-5deg.npy");
  SKIP_WITHOUT(path);
  struct Case {
    const char* file;
    double index;
    bool first_flat;
    double phase;
  };
  const Case cases[] = {{"scan_patterns/mid40_table_0s_1s_1e-5deg.npy", 1.5089, true, 180.0},
                        {"scan_patterns/mid70_table_0s_1s_1e-5deg.npy", 1.8144, false, 0.0}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.file);
    std::ifstream file(shared_data(c.file), std::ios::binary);
    file.seekg(128);
    std::vector<std::int32_t> table(200000);
    file.read(reinterpret_cast<char*>(table.data()), 800000);
    const std::string yaml = fmt::format(
        "range_max: 90\npattern: prisms\nprisms:\n  shot_rate: 100000\n  shot_phase: 1\n"
        "  line_heights: [0]\n  wedges:\n"
        "    - {{angle_deg: 18, index: {0}, rate: 121.5666666666666667, phase_deg: {1}, "
        "flat_first: {2}}}\n"
        "    - {{angle_deg: 18, index: {0}, rate: -77.7333333333333333, phase_deg: {1}, "
        "flat_first: {3}}}\n",
        c.index,
        c.phase,
        c.first_flat,
        !c.first_flat);
    const auto pattern = make_pattern(parse_lidar(yaml, "mid.yaml"));
    const Executor executor(2);
    const auto beams = pattern->beams(0, executor);
    // the first shot lies one period after the start: 9,999 in the first scan
    ASSERT_EQ(beams.size(), 9999u);
    for (std::size_t row = 0; row < beams.size(); ++row) {
      const Vector3d truth =
          direction_of(table[2 * row] * 1e-5 * kDegree, table[2 * row + 1] * 1e-5 * kDegree);
      ASSERT_LT(angle_between_deg(truth, beams[row].direction_sensor.cast<double>()), 4e-5) << row;
    }
  }
}

TEST(Vlp32c, FiresItsChannelsAtTheirTimesAndAngles) {
  const auto beams = scan_of("vlp32c");
  // 0.1 s / 55.296 us cycles of 32
  EXPECT_NEAR(static_cast<double>(beams.size()), 0.1 / 55.296e-6 * 32, 32.0);
  double low = 90;
  double high = -90;
  std::set<int> rings;
  for (const Beam& beam : beams) {
    low = std::min(low, angles_of(beam).elevation_deg);
    high = std::max(high, angles_of(beam).elevation_deg);
    rings.insert(beam.ring);
  }
  EXPECT_EQ(rings.size(), 32u);
  EXPECT_NEAR(low, -25.0, 1e-4);
  EXPECT_NEAR(high, 15.0, 1e-4);
  // the head turns clockwise seen from above, 36 deg in 10 ms
  const auto ring0_azimuth = [&](std::size_t cycle) {
    return angles_of(beams[cycle * 32]).azimuth_deg;
  };
  EXPECT_NEAR(ring0_azimuth(0), -1.4, 1e-3);  // rot_correction -1.4: clockwise by 1.4
  EXPECT_NEAR(ring0_azimuth(181) - ring0_azimuth(0), -3600.0 * 181 * 55.296e-6, 1e-3);
  // a pair of channels fires every 2.304 us
  EXPECT_EQ(beams[2].time_offset - beams[0].time_offset, Duration(2304));
}

TEST(Vlp32c, RingsCountFromBelowAsInItsDriver) {
  std::map<int, double> elevation;
  for (const Beam& beam : scan_of("vlp32c")) elevation[beam.ring] = angles_of(beam).elevation_deg;
  for (int ring = 1; ring < 32; ++ring) EXPECT_GT(elevation[ring], elevation[ring - 1]) << ring;
}

TEST(Lidars, AllBeamsOfAScanFireWithinIt) {
  const Executor executor(1);
  for (const std::string& name : model_names("lidars")) {
    SCOPED_TRACE(name);
    const LidarSettings settings = load_lidar(name);
    const Schedule scans(settings.rate);
    const auto pattern = make_pattern(settings);
    for (const std::uint64_t k : {0, 1, 2, 37}) {
      const auto index = static_cast<std::int64_t>(k);
      const Duration period = scans.at(index + 1) - scans.at(index);
      Duration last{0};
      for (const Beam& beam : pattern->beams(k, executor)) {
        ASSERT_GE(beam.time_offset, last);
        ASSERT_LT(beam.time_offset, period);
        last = beam.time_offset;
      }
    }
  }
}

TEST(Vlp32c, NoFiringIsLostOrTakenTwiceBetweenScans) {
  const Executor executor(1);
  const LidarSettings settings = load_lidar("vlp32c");
  const auto pattern = make_pattern(settings);
  std::map<int, std::vector<std::int64_t>> times;  // of each ring, in the sensor's time
  for (std::uint64_t k = 0; k < 5; ++k) {
    const Duration start =
        Schedule(settings.rate).at(static_cast<std::int64_t>(k)).time_since_epoch();
    for (const Beam& beam : pattern->beams(k, executor)) {
      times[beam.ring].push_back((start + beam.time_offset).count());
    }
  }
  EXPECT_EQ(times.size(), 32u);
  for (const auto& [ring, fired] : times) {
    for (std::size_t i = 1; i < fired.size(); ++i) {
      ASSERT_NEAR(static_cast<double>(fired[i] - fired[i - 1]), 55296.0, 1.0) << ring;
    }
  }
}

TEST(Hdl64e, HasItsPointsAndTheParallaxOfItsBlocks) {
  const auto beams = scan_of("hdl64e");
  EXPECT_NEAR(static_cast<double>(beams.size()), 133333.0, 130.0);
  double highest = 0.0;
  for (const Beam& beam : beams) {
    highest = std::max(highest, static_cast<double>(beam.origin_sensor.z()));
    ASSERT_LT(beam.origin_sensor.head<2>().norm(), 0.12f);
  }
  EXPECT_NEAR(highest, 0.215, 0.01);
}

TEST(Prisms, ShippedMid40AndMid70ReachTheirCones) {
  for (const auto& [name, half] : {std::pair("mid40", 19.173), std::pair("mid70", 35.216)}) {
    SCOPED_TRACE(name);
    double widest = 0.0;
    for (std::uint64_t k = 0; k < 5; ++k) {
      const auto beams = scan_of(name, k);
      ASSERT_NEAR(static_cast<double>(beams.size()), 10000.0, 1.0);
      for (const Beam& beam : beams) {
        const double away = static_cast<double>(beam.direction_sensor.x());
        widest = std::max(widest, std::acos(std::min(1.0, away)) / kDegree);
      }
    }
    EXPECT_NEAR(widest, half, 0.02);
  }
}

TEST(Grids, MarsimGridAndDepthCamera) {
  const auto grid = scan_of("marsim_grid");
  ASSERT_EQ(grid.size(), 385u * 350u);
  EXPECT_NEAR(angles_of(grid.front()).azimuth_deg, 38.4, 1e-3);  // half a cell inside 77 deg
  EXPECT_NEAR(angles_of(grid.front()).elevation_deg, 34.9, 1e-3);
  EXPECT_NEAR(angles_of(grid.back()).azimuth_deg, -38.4, 1e-3);
  const auto camera = scan_of("d455");
  ASSERT_EQ(camera.size(), 640u * 480u);
  const Angles left = angles_of(camera[240 * 640]);
  const Angles right = angles_of(camera[240 * 640 + 639]);
  EXPECT_NEAR(left.azimuth_deg - right.azimuth_deg, 78.4, 0.3);
  EXPECT_EQ(camera.back().time_offset, Duration{0});
}

TEST(CsvPattern, ReplaysTheUsersTableInALoop) {
  const TemporaryFolder folder;
  testing::write_file(folder / "mine.csv",
                      "Time/s,Azimuth/deg,Zenith/deg\n1,0,90\n2,90,90\n3,0,0\n");
  testing::write_file(folder / "mine.yaml",
                      "range_max: 50\nrate: 10\npattern: csv\ncsv:\n  file: mine.csv\n"
                      "  points_per_second: 40\n  lines: 3\n");
  const Executor executor(1);
  const auto pattern = make_pattern(load_lidar(folder / "mine.yaml"));
  const auto first = pattern->beams(0, executor);
  const auto second = pattern->beams(1, executor);
  ASSERT_EQ(first.size(), 4u);
  ASSERT_EQ(second.size(), 4u);
  EXPECT_NEAR(first[0].direction_sensor.x(), 1.0f, 1e-6f);
  EXPECT_NEAR(first[1].direction_sensor.y(), 1.0f, 1e-6f);
  EXPECT_NEAR(first[2].direction_sensor.z(), 1.0f, 1e-6f);
  EXPECT_EQ(second[0].ring, 1);
  EXPECT_EQ(first[1].time_offset, Duration(25'000'000));
  testing::write_file(folder / "mine.csv", "Azimuth,Zenith\n1,zwei\n");
  expect_contains(error_of([&] { make_pattern(load_lidar(folder / "mine.yaml")); }),
                  "mine.csv:2: 'zwei' is no number");
}

TEST(LidarSettings, BadFilesSayWhereAndWhat) {
  const auto error = [](const char* text) {
    return error_of([&] { make_pattern(parse_lidar(text, "x.yaml")); });
  };
  expect_contains(error("pattern: rotor\n"), "range_max: missing");
  expect_contains(error("range_max: 10\npattern: spiral\n"), "x.yaml:2: pattern: 'spiral'");
  expect_contains(error("range_max: 10\nrate: -5\npattern: rotor\n"), "x.yaml:2: rate: -5");
  expect_contains(error("range_max: 10\nrate: 10 Hz\npattern: rotor\n"), "plain number in Hz");
  expect_contains(error("range_max: 10\nrange_min: 20\npattern: rotor\n"), "x.yaml:2: range_min");
  expect_contains(error("range_max: 10\npattern: rings\n"), "no channels; give a table");
  // where it looked
  const std::string absent = error("range_max: 10\npattern: rings\nrings: {table: absent.csv}\n");
  expect_contains(absent, "x.yaml:3: rings.table: 'absent.csv' is neither absent.csv nor ");
  expect_contains(absent, data_folder() + "/lidars/tables/absent.csv; give");
  expect_contains(absent, "velodyne_vlp32c");
  expect_contains(error("range_max: 10\npattern: grid\ngrid: {projection: pinhole}\n"),
                  "fx and fy");
  // memory for a scan is asked for at once
  for (const char* text : {"pattern: rotor\nrate: 0.01\nrotor: {shot_rate: 1e7}\n",
                           "pattern: prisms\nrate: 0.01\nprisms: {shot_rate: 1e7}\n",
                           "pattern: rings\nrate: 0.1\nrings: {channels: 1024, cycle_us: 1}\n",
                           "pattern: rings\nrings: {channels: 1024, convention: ouster, columns: "
                           "65536}\n",
                           "pattern: csv\nrate: 0.01\ncsv: {file: a.csv, points_per_second: 1e8}\n",
                           "pattern: grid\ngrid: {columns: 16384, rows: 16384}\n"}) {
    expect_contains(error(fmt::format("range_max: 10\n{}", text).c_str()), "16000000 at most");
  }
}

}  // namespace
}  // namespace pointflight
