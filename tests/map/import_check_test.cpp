#include "pointflight/map/import/import_check.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "pointflight/io/cloud_writer.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::import_points;
using testing::TemporaryFolder;
using testing::write_file;

ShapeScene hall() {
  ShapeScene scene;
  scene.add_box({0, 0, 0}, {30, 20, 6});
  return scene;
}

/// The hall in a file, in units of which a metre has `per_metre`.
void write_hall(const std::string& path, double per_metre) {
  auto writer = write_cloud(OutputFile(path), {});
  std::vector<CloudPoint> points;
  hall().sample(60.0, 0.0, 1, [&](const Vector3d& p) { points.push_back({per_metre * p, 0.0f}); });
  writer->write(std::span<const CloudPoint>(points));
  writer->commit();
}

std::vector<std::string> warnings(const std::string& path, ImportOptions options = {}) {
  options.quality = TreeQuality::kNormal;
  return import_clouds({path}, options, Executor(2)).report.warnings;
}

TEST(ImportCheck, AHallInMetresIsFine) {
  const TemporaryFolder folder;
  write_hall(folder / "a.pcd", 1.0);
  EXPECT_EQ(warnings(folder / "a.pcd"), std::vector<std::string>());
}

TEST(ImportCheck, Slow_OtherUnitsAreSaidWithTheScaleThatMendsThem) {
  const TemporaryFolder folder;
  struct Case {
    double per_metre;
    const char* scale;
  };
  for (const auto& [per_metre, scale] :
       {Case{1000.0, "--scale 0.001"}, Case{100.0, "--scale 0.01"}, Case{0.001, "--scale 1e+03"}}) {
    SCOPED_TRACE(scale);
    write_hall(folder / "a.ply", per_metre);
    const auto said = warnings(folder / "a.ply");
    ASSERT_EQ(said.size(), 1u);
    expect_contains(said[0], scale);
    ImportOptions options;
    options.scale = 1.0 / per_metre;
    EXPECT_EQ(warnings(folder / "a.ply", options), std::vector<std::string>());
  }
}

TEST(ImportCheck, AUnitInTheHeaderThatWasNotHeeded) {
  const TemporaryFolder folder;
  std::string text =
      "ply\nformat ascii 1.0\ncomment units: feet\nelement vertex 900\n"
      "property float x\nproperty float y\nproperty float z\nend_header\n";
  for (int i = 0; i < 900; ++i) text += fmt::format("{} {} 0\n", 0.2 * (i % 30), 0.2 * (i / 30));
  write_file(folder / "a.ply", text);
  const auto said = warnings(folder / "a.ply");
  ASSERT_EQ(said.size(), 1u);
  expect_contains(said[0], "foot; --scale 0.3048");
  ImportOptions options;
  options.scale = 0.3048;
  EXPECT_EQ(warnings(folder / "a.ply", options), std::vector<std::string>());
}

TEST(ImportCheck, Slow_TheSharedMapsAreFine) {
  for (const char* name : {"maps/drone_hall.pcd",
                           "maps/garage.pcd",
                           "maps/forest_tls.pcd",
                           "maps/catec_testbed.pcd"}) {
    const std::string path = testing::shared_data(name);
    SKIP_WITHOUT(path);
    EXPECT_EQ(warnings(path), std::vector<std::string>()) << name;
  }
}

TEST(ImportCheck, ScalesThatNoMapCanHoldAreRefusedBeforeWriting) {
  const TemporaryFolder folder;
  write_hall(folder / "a.pcd", 1.0);
  ImportOptions options;
  options.scale = 1e9;
  expect_contains(error_of([&] { warnings(folder / "a.pcd", options); }), "check --scale");
  options.scale = 1e-9;
  EXPECT_NE(error_of([&] { warnings(folder / "a.pcd", options); }), "");
}

TEST(ImportCheck, OptionsThatMakeNoSenseAreErrors) {
  const std::vector<CloudPoint> points(100, {{1, 2, 3}, 0.0f});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [&](const std::function<void(ImportOptions&)>& change) {
    ImportOptions options;
    options.resolution = 0.1;
    change(options);
    return error_of([&] { import_points(points, options); });
  };
  expect_contains(refused([&](ImportOptions& o) { o.resolution = nan; }), "resolution");
  expect_contains(refused([&](ImportOptions& o) { o.resolution = -1.0; }), "resolution");
  expect_contains(refused([&](ImportOptions& o) { o.scale = nan; }), "scale");
  expect_contains(refused([&](ImportOptions& o) { o.scale = 0.0; }), "scale");
  expect_contains(refused([&](ImportOptions& o) { o.shift.y() = nan; }), "shift");
  expect_contains(refused([&](ImportOptions& o) { o.up = 'x'; }), "up");
  expect_contains(refused([&](ImportOptions& o) { o.tau = 2.0f; }), "tau");
  expect_contains(refused([&](ImportOptions& o) { o.outliers.neighbours = 0; }), "neighbour");
  const std::vector<CloudSource> none;
  expect_contains(error_of([&] { import_clouds(none, {}, Executor(1)); }), "no clouds");
}

TEST(ImportCheck, ColoursBecomeIntensitiesWhereThereAreNone) {
  const TemporaryFolder folder;
  for (const bool intensity : {false, true}) {
    auto writer = write_cloud(OutputFile(folder / "a.pcd"), {intensity, true});
    std::vector<CloudPoint> points;
    for (int i = 0; i < 40; ++i) {
      for (int j = 0; j < 40; ++j) {
        CloudPoint point{{0.02 * i, 0.02 * j, 0.0}, 7.0f};
        point.color = i < 20 ? std::array<std::uint8_t, 3>{255, 255, 255}
                             : std::array<std::uint8_t, 3>{0, 0, 100};
        points.push_back(point);
      }
    }
    writer->write(std::span<const CloudPoint>(points));
    writer->commit();
    ImportOptions options;
    options.resolution = 0.1;
    const ImportedMap imported = import_clouds({folder / "a.pcd"}, options, Executor(1));
    EXPECT_TRUE(imported.report.has_intensity);
    EXPECT_EQ(imported.report.intensity_from_colors, !intensity);
    const auto map =
        SurfelMap::from_bytes(map_bytes(imported.tree, imported.description), "memory");
    map->for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t word) {
      if (p.x() > 0.3 && p.x() < 0.5) return;  // cells with both
      const float wanted = intensity ? 7.0f : (p.x() < 0.4 ? 255.0f : 11.4f);
      EXPECT_NEAR(map->intensity(word), wanted, 1.0f);
    });
  }
}

/// Points on a wall at a position, as text with so many decimals, or as floats.
std::string wall_at(const Vector3d& at, const std::function<std::string(double)>& text) {
  std::string rows;
  for (int i = 0; i < 60; ++i) {
    for (int k = 0; k < 40; ++k) {
      rows += text(at.x() + 0.0513 * i) + " " + text(at.y() + 0.0137 * i) + " " +
              text(at.z() + 0.0507 * k) + "\n";
    }
  }
  return rows;
}

TEST(ImportCheck, CoordinatesWithTooFewDigitsAreSaid) {
  const testing::TemporaryFolder folder;
  const Vector3d utm(836422.8, 4818054.7, 301.5);
  const auto said = [&](const Vector3d& at, const std::function<std::string(double)>& text) {
    testing::write_file(folder / "a.xyz", wall_at(at, text));
    std::string all;
    ImportOptions options;
    options.resolution = 0.2;
    for (const std::string& line : warnings(folder / "a.xyz", options)) {
      if (line.find("stored in steps") != std::string::npos) all += line;
    }
    return all;
  };
  const auto exact = [](double v) { return fmt::format("{:.3f}", v); };
  const auto single = [](double v) { return fmt::format("{}", static_cast<float>(v)); };
  const auto six_digits = [](double v) { return fmt::format("{:.6g}", v); };
  const auto lattice = [](double v) { return fmt::format("{:.2f}", 0.05 * std::round(v / 0.05)); };
  EXPECT_EQ(said(utm, exact), "");
  EXPECT_EQ(said(utm, lattice), "") << "a lattice of 5 cm is meant";
  EXPECT_EQ(said({12.0, -30.0, 1.0}, single), "");
  EXPECT_EQ(said({12.0, -30.0, 1.0}, lattice), "");
  expect_contains(said(utm, single), "up to 4.82e+06 are stored in steps of 0.5 m");
  EXPECT_NE(said({8364.2, 4818.7, 301.5}, six_digits), "") << "what streams print by default";
}

TEST(ImportCheck, OneBrightPointDoesNotTakeTheStepsFromAllOthers) {
  const testing::TemporaryFolder folder;
  std::string rows;
  for (int i = 0; i < 100; ++i) {
    for (int k = 0; k < 100; ++k) {
      const int bright = i == 50 && k == 50 ? 65535 : 10 + (i + k) % 181;
      rows += fmt::format("{} {} 0 {}\n", 0.1 * i, 0.1 * k, bright);
    }
  }
  testing::write_file(folder / "a.xyz", rows);
  ImportOptions options;
  options.resolution = 0.1;
  const ImportedMap made = import_clouds({folder / "a.xyz"}, options, Executor(2));
  EXPECT_GT(made.report.intensity_outliers_from, 150.0);
  const auto map = SurfelMap::from_bytes(map_bytes(made.tree, made.description), "a.pfmap");
  std::set<float> levels;
  float brightest = 0.0f;
  map->for_each_surfel([&](const Vector3d&, const Vector3d&, double, std::uint32_t word) {
    levels.insert(map->intensity(word));
    brightest = std::max(brightest, map->intensity(word));
  });
  EXPECT_GT(levels.size(), 100u);
  EXPECT_GT(brightest, 10000.0f) << "and it is still bright";
}

}  // namespace
}  // namespace pointflight
