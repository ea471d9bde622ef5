#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "pointflight/picture/canvas.hpp"
#include "pointflight/picture/map_layers.hpp"
#include "pointflight/picture/perspective.hpp"
#include "pointflight/picture/pictures.hpp"
#include "pointflight/picture/plot.hpp"
#include "pointflight/picture/scan_statistics.hpp"
#include "tests/support.hpp"

namespace pointflight::picture {
namespace {

using testing::map_of;
using testing::repeats;

TEST(Ticks, AreRoundAndNotTooMany) {
  for (double span = 1e-3; span < 1e7; span *= 1.37) {
    for (const int most : {1, 4, 12}) {
      const double step = tick_step(span, most);
      const double digit = step / std::pow(10.0, std::floor(std::log10(step) + 1e-9));
      EXPECT_TRUE(std::abs(digit - 1) < 1e-6 || std::abs(digit - 2) < 1e-6 ||
                  std::abs(digit - 5) < 1e-6)
          << step;
      const auto values = ticks(-0.3 * span, 0.7 * span, step);
      EXPECT_LE(values.size(), static_cast<std::size_t>(most) + 1);
      if (most > 1) {
        EXPECT_GE(values.size(), static_cast<std::size_t>(most) / 3) << span;
      }
      for (const double value : values) {
        EXPECT_GE(value, -0.3000001 * span);
        EXPECT_LE(value, 0.7000001 * span);
      }
    }
  }
  EXPECT_EQ(tick_step(360.0, 12, Steps::kAngle), 30.0);
  EXPECT_EQ(tick_step(70.0, 6, Steps::kAngle), 15.0);
}

TEST(Ticks, AreWrittenAsPeopleWrite) {
  EXPECT_EQ(tick_text(-0.0, 1.0), "0");
  EXPECT_EQ(tick_text(-1e-17, 0.1), "0.0");
  EXPECT_EQ(tick_text(0.30000000000000004, 0.1), "0.3");
  EXPECT_EQ(tick_text(-45.0, 15.0), "-45");
  EXPECT_EQ(tick_text(0.025, 0.005), "0.025");
}

/// A floor of 20 x 12 m with a table; `roof`: level, from 3 m on, all over.
ShapeScene room(bool roof) {
  ShapeScene scene;
  const auto plate = [&](const Vector3d& center, const Vector3d& size) {
    scene.add_box(center - 0.5 * size, center + 0.5 * size);
  };
  plate({10, 6, -0.05}, {20, 12, 0.1});
  plate({5, 5, 0.75}, {2, 1, 0.1});
  for (const double x : {0.0, 20.0}) plate({x, 6, 1.5}, {0.2, 12, 3});
  if (roof) plate({10, 6, 3.05}, {20, 12, 0.1});
  return scene;
}

TEST(MapLayers, FindACeilingAndLeaveWhatStandsBelowIt) {
  const MapLayers layers(*map_of(room(true), 0.1, 6.0));
  EXPECT_TRUE(layers.has_ceiling());
  EXPECT_TRUE(layers.is_ceiling({10, 6, 3.0}));
  EXPECT_TRUE(layers.is_ceiling({5, 5, 3.0}));   // over the table
  EXPECT_FALSE(layers.is_ceiling({5, 5, 0.8}));  // the table
  EXPECT_FALSE(layers.is_ceiling({10, 6, 0.0}));
  EXPECT_NEAR(layers.floor_at({10, 6, 2.0}), 0.0, 0.2);
}

TEST(MapLayers, Statistics_DoNotTakeTheOpenOrCrownsForACeiling) {
  EXPECT_FALSE(MapLayers(*map_of(room(false), 0.1, 6.0)).has_ceiling());
  // crowns: leaves at any height from 4 to 9 m over all of the ground
  std::vector<Vector3d> points;
  for (int i = 0; i < 120000; ++i) {
    const auto part = [&](double step) { return std::fmod(i * step, 1.0); };
    const double x = 20.0 * part(0.7548776662);
    const double y = 20.0 * part(0.5698402910);
    const double wave = std::sin(1.9 * x) * std::cos(2.3 * y);
    points.emplace_back(x, y, i % 3 == 0 ? 0.0 : 6.0 + 2.0 * wave + 1.5 * part(0.3819660113));
  }
  EXPECT_FALSE(MapLayers(*map_of(points, 0.15)).has_ceiling());
}

TEST(Tracks, KeepTheWayInBoundedMemory) {
  Track track;
  const auto place = [](double s) { return Vector3d(s, 10.0 * std::sin(0.01 * s), 2.0); };
  for (int i = 0; i <= 200000; ++i) track.add(place(0.02 * i));
  const auto points = track.points();
  EXPECT_LE(points.size(), 2001u);
  EXPECT_GT(points.size(), 500u);
  EXPECT_EQ(points.front(), place(0.0));
  EXPECT_EQ(points.back(), place(4000.0));
  double gap = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    gap = std::max(gap, (points[i] - points[i - 1]).norm());
  }
  EXPECT_LT(gap, 8.0);
}

TEST(Tracks, ThinnedItemsAreFromAllOfARun) {
  Thinned<int> some(100);
  for (int i = 0; i < 100000; ++i) some.add(i);
  EXPECT_LE(some.items().size(), 100u);
  EXPECT_GE(some.items().size(), 50u);
  for (std::size_t i = 1; i < some.items().size(); ++i) {
    EXPECT_EQ(some.items()[i] - some.items()[i - 1], some.items()[1] - some.items()[0]);
  }
  EXPECT_GT(some.items().back(), 97000);
}

TEST(RunPicture, FiftyThousandObstaclesAreFoundByTheirLabels) {
  // each sample is looked up: by a search of all traces this takes minutes
  RunPicture picture;
  const int count = repeats(50000);
  for (int sample = 0; sample < 20; ++sample) {
    for (int i = 0; i < count; ++i) {
      picture.add_obstacle(
          10001u + static_cast<std::uint32_t>(i), {0.1 * sample, 1.0 * i, 1.0}, 0.3);
    }
  }
  ASSERT_EQ(picture.traces.size(), static_cast<std::size_t>(count));
  EXPECT_EQ(picture.traces[7].track.points().size(), 20u);
  // another one in its place begins anew
  picture.add_obstacle(10008u, {50, 50, 1}, 0.4);
  EXPECT_EQ(picture.traces[7].track.points().size(), 1u);
  EXPECT_EQ(picture.traces[7].radius, 0.4);
}

/// No words over others or over the edge.
void expect_legible(const Canvas& canvas) {
  const auto& texts = canvas.texts();
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const auto& a = texts[i];
    EXPECT_GE(a.left, 0.0) << a.words;
    EXPECT_GE(a.top, 0.0) << a.words;
    EXPECT_LE(a.right, canvas.width()) << a.words;
    EXPECT_LE(a.bottom, canvas.height()) << a.words;
    for (std::size_t j = 0; j < i; ++j) {
      const auto& b = texts[j];
      const bool apart =
          a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;
      EXPECT_TRUE(apart) << "'" << a.words << "' over '" << b.words << "'";
    }
  }
}

bool has_words(const Canvas& canvas, const std::string& words) {
  const auto& texts = canvas.texts();
  return std::any_of(texts.begin(), texts.end(), [&](const Canvas::TextBox& box) {
    return box.words.find(words) != std::string::npos;
  });
}

RunPicture run_of(std::size_t vehicles, const Vector3d& step) {
  RunPicture run;
  run.title =
      "a title of a run that is long enough to be cut, 1234.5 m flown in 678.9 s, completed";
  run.subtitle = "12345 scans, 678.90 M points; closest approach 0.12 m; 3 collisions; and more";
  for (std::size_t v = 0; v < vehicles; ++v) {
    for (int i = 0; i <= 50; ++i) {
      run.add_path_point(v, Vector3d(2, 2 + 0.3 * static_cast<double>(v), 1) + i * step);
    }
    run.names.push_back(fmt::format("scout{}", v));
    run.waypoints.push_back({Vector3d(2, 2, 1) + 60 * step});
  }
  run.collisions.add({3, 3, 1});
  run.add_obstacle(10001, {4, 4, 1}, 0.5);
  for (int i = 0; i < 1000; ++i) run.seen.add({0.02 * i, 6.0, 0.003 * i});
  return run;
}

TEST(Pages, AreLegibleForMapsOfManyForms) {
  const struct {
    Vector3d size;
    double resolution;
  } kForms[] = {{{30, 20, 8}, 0.5},
                {{300, 8, 4}, 2.0},
                {{8, 300, 4}, 2.0},
                {{3, 2, 60}, 0.5},
                {{2000, 1500, 90}, 20.0}};
  for (const auto& form : kForms) {
    ShapeScene scene;
    const Vector3d middle = 0.5 * form.size;
    scene.add_box({0, 0, -0.1}, {form.size.x(), form.size.y(), 0.0});
    scene.add_box({0.9 * middle.x(), 0.9 * middle.y(), 0.0},
                  {1.1 * middle.x(), 1.1 * middle.y(), form.size.z()});
    const auto map = map_of(scene, form.resolution, 4.0);
    SCOPED_TRACE(fmt::format("{} x {} x {}", form.size.x(), form.size.y(), form.size.z()));
    expect_legible(*map_page(
        *map,
        "/a/very/long/path/to/a/map/that/will/not/fit/on/the/page/of/most/maps/at/all.pfmap"));
    for (const std::size_t vehicles : {1, 5, 40}) {
      const auto page = overview_page(*map, run_of(vehicles, {0.05, 0.02, 0.01}));
      expect_legible(*page);
      EXPECT_TRUE(
          has_words(*page, fmt::format("scout{}", std::min<std::size_t>(vehicles, 24) - 1)));
      EXPECT_EQ(has_words(*page, "and 16 more"), vehicles == 40);
    }
  }
}

TEST(Pages, TheFlightIsInTheFrame) {
  const auto map = map_of(room(true), 0.2, 6.0);
  // far out of the map: the axes must reach there
  const auto page = overview_page(*map, run_of(1, {2.0, 1.0, -0.5}));
  expect_legible(*page);
  EXPECT_TRUE(has_words(*page, "120") || has_words(*page, "100"));
  EXPECT_TRUE(has_words(*page, "-20") || has_words(*page, "-25"));
}

TEST(Pages, SensorsOfEveryPattern) {
  for (const char* name : {"avia", "mid360", "vlp32c", "os1_32", "d455", "marsim_grid"}) {
    SCOPED_TRACE(name);
    expect_legible(*lidar_page(load_lidar(name)));
  }
}

TEST(ScanStatistics, OfPatternsThatAreKnown) {
  const auto of = [](const std::string& text) {
    return scan_statistics(parse_lidar("range_max: 10\n" + text, "x.yaml"));
  };
  // 90 columns of 1 deg by 10 rows of 2 deg
  const auto grid =
      of("pattern: grid\ngrid: {columns: 90, rows: 10, fov_horizontal_deg: 90, fov_vertical_deg: "
         "20}\n");
  EXPECT_EQ(grid.beams, 900u);
  EXPECT_EQ(grid.beams_a_second, 9000.0);
  EXPECT_EQ(grid.rings, 10u);
  EXPECT_EQ(grid.span, 0.0);
  EXPECT_NEAR(grid.azimuth_max, 44.5, 1e-4);
  EXPECT_NEAR(grid.elevation_min, -9.0, 1e-4);
  EXPECT_NEAR(grid.nearest, 0.995, 0.01);  // a degree of azimuth at the middle elevations
  ASSERT_TRUE(grid.between_rings);
  EXPECT_NEAR(grid.between_rings->first, 2.0, 1e-3);
  EXPECT_NEAR(grid.between_rings->second, 2.0, 1e-3);
  const auto rings =
      of("rate: 20\npattern: rings\nrings: {channels: 16, cycle_us: 50, channel_interval_us: 2}\n");
  EXPECT_EQ(rings.beams, 16000u);
  EXPECT_EQ(rings.beams_a_second, 320000.0);
  EXPECT_NEAR(rings.along_ring, 0.36, 0.02);
  EXPECT_NEAR(rings.span, 0.05, 1e-4);
}

TEST(Coverage, IsCompleteForADenseGridAndGrowsForARosette) {
  const auto grid = coverage_of(load_lidar("marsim_grid"), 1.0);
  EXPECT_NEAR(grid.fraction.back(), 1.0, 0.02);
  EXPECT_NEAR(grid.fraction[1], 1.0, 0.02);  // all at once
  const auto avia = coverage_of(load_lidar("avia"), 1.0);
  EXPECT_TRUE(std::is_sorted(avia.fraction.begin(), avia.fraction.end()));
  EXPECT_LT(avia.fraction[6], 0.7);
  EXPECT_GT(avia.fraction.back(), 0.7);
}

TEST(Perspective, ShowsWhatIsInFrontAndHidesWhatIsBehind) {
  // a floor, and a wall along its diagonal that stands between the eye in the south west and a half
  ShapeScene scene;
  scene.add_rectangle({-10, -10, 0}, {20, 0, 0}, {0, 20, 0});
  scene.add_rectangle({-7, 7, 0}, {14, -14, 0}, {0, 0, 3});
  const auto map = map_of(scene, 0.2);
  Aabb shown;
  shown.add({-10, -10, 0});
  shown.add({10, 10, 3});
  const double none = std::numeric_limits<double>::infinity();
  const Frame frame{50, 80, 640, 400};
  const Perspective view(*map, shown, none, frame);
  std::size_t looked_at = 0;
  for (double x = -9; x <= 9; x += 0.75) {
    for (double y = -9; y <= 9; y += 0.75) {
      const bool before_the_wall = x + y < -0.5;
      const bool right_behind = x + y > 0.5 && x + y < 2.5 && std::abs(x - y) < 10;
      if (!before_the_wall && !right_behind) continue;
      ++looked_at;
      const auto at = view.visible({x, y, 0.05});
      EXPECT_EQ(at.has_value(), before_the_wall) << x << ", " << y;
      EXPECT_FALSE(view.visible({x, y, -1.5})) << "under the floor";
      if (!at) continue;
      EXPECT_TRUE(at->first >= 50 && at->first <= 690 && at->second >= 80 && at->second <= 480);
    }
  }
  EXPECT_GT(looked_at, 200u);
  // above the wall one sees what is behind it once it is cut lower
  const Perspective cut(*map, shown, 0.5, frame);
  EXPECT_TRUE(cut.visible({1.2, 1.2, 0.05}));
  EXPECT_FALSE(view.visible({1.2, 1.2, 0.05}));
}

}  // namespace
}  // namespace pointflight::picture
