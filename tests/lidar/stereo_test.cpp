#include "pointflight/lidar/stereo.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "pointflight/core/constants.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

constexpr double kFocalBaseline = 392.57 * 0.095;  // of the D455, px m

/// What a D455 at the origin sees of shapes, exactly: rays of its left imager.
struct LeftView {
  LidarSettings settings = load_lidar("d455");
  std::vector<Hit> hits;
  std::vector<float> shares;
  std::vector<Vector3d> directions;

  explicit LeftView(const ShapeScene& scene) {
    const GridSettings& g = settings.grid;
    for (std::int64_t v = 0; v < g.rows; ++v) {
      for (std::int64_t u = 0; u < g.columns; ++u) {
        const Vector3d d = Vector3d(1.0,
                                    -(static_cast<double>(u) - g.cx) / g.fx,
                                    -(static_cast<double>(v) - g.cy) / g.fy)
                               .normalized();
        directions.push_back(d);
        shares.push_back(static_cast<float>(d.x()));
        Hit hit;
        if (const auto range = scene.intersect(Vector3d::Zero(), d)) {
          hit.range = static_cast<float>(*range);
          hit.cos_incidence = 1.0f;
        }
        hits.push_back(hit);
      }
    }
  }

  [[nodiscard]] std::vector<Return> depths(std::uint64_t image, bool noise) const {
    const RandomStream pixels(7, StreamId::kLidarRangeNoise, 0);
    const RandomStream windows(7, StreamId::kStereo, 0);
    return StereoCamera(settings).measure(
        hits, shares, {pixels, windows, image, noise}, Executor(2));
  }
};

ShapeScene wall_at(double depth) {
  ShapeScene scene;
  scene.add_box({depth, -30, -30}, {depth + 1, 30, 30});
  return scene;
}

TEST(StereoCamera, NoiseIsOfTheDisparityAndCommonToAWindow) {
  for (const double depth : {1.0, 2.0, 4.0}) {
    LeftView view(wall_at(depth));
    view.settings.grid.stereo.disparity_steps = 0;
    view.settings.noise.range_step = 0.0;
    view.settings.range_max = 20.0;
    const double disparity = kFocalBaseline / depth;
    constexpr std::size_t kImages = 6;
    double squares = 0.0;
    double sum = 0.0;
    double beside = 0.0;
    double far = 0.0;
    double count = 0.0;
    for (std::size_t image = 0; image < kImages; ++image) {
      const std::vector<Return> returns = view.depths(image, true);
      const auto error = [&](std::size_t i) {
        return kFocalBaseline / static_cast<double>(returns[i].range) - disparity;
      };
      for (std::size_t row = 0; row < 480; ++row) {
        for (std::size_t u = 100; u < 600; ++u) {
          const std::size_t i = row * 640 + u;
          ASSERT_TRUE(returns[i].is_return());
          const double e = error(i);
          squares += e * e;
          sum += e;
          beside += e * error(i + 1);
          far += e * error(i + 20);
          count += 1.0;
        }
      }
    }
    // 1.4 million pixels, some 30,000 windows
    EXPECT_NEAR(std::sqrt(squares / count), 0.08, 0.002) << depth;
    EXPECT_NEAR(sum / count, 0.0, 0.003);
    EXPECT_NEAR(far / squares, 0.0, 0.02);
    // 0.91 of the variance is common; neighbours share most of it
    EXPECT_GT(beside / squares, 0.7);
    EXPECT_LT(beside / squares, 0.91);
  }
}

TEST(StereoCamera, DisparitiesAreWholeStepsAndDepthsMillimetres) {
  const LeftView view(wall_at(3.21));
  for (const Return& made : view.depths(0, true)) {
    if (!made.is_return()) continue;
    const auto depth = static_cast<double>(made.range);
    EXPECT_NEAR(std::round(depth * 1000.0), depth * 1000.0, 1e-3);
    // of half a millimetre of depth, in steps
    const double steps = 32.0 * kFocalBaseline / depth;
    EXPECT_NEAR(steps, std::round(steps), 32.0 * kFocalBaseline / depth / depth * 0.00051);
  }
  for (const Return& made : view.depths(0, false)) {
    if (!made.is_return()) continue;
    EXPECT_NEAR(made.range, 3.21, 3.21 * 3.21 / 32.0 / kFocalBaseline / 2.0 + 5e-4);
    EXPECT_NEAR(made.true_range, 3.21, 1e-5);
  }
}

TEST(StereoCamera, ABandOnTheLeftAndWhatIsTooNearHasNoDepth) {
  for (const double depth : {0.7, 1.0, 2.5, 5.0}) {
    const LeftView view(wall_at(depth));
    const double band = kFocalBaseline / depth;  // px
    const std::vector<Return> returns = view.depths(0, false);
    for (std::size_t u = 0; u < 640; ++u) {
      const bool is_seen = static_cast<double>(u) - band > -0.5;
      EXPECT_EQ(returns[240 * 640 + u].is_return(), is_seen) << depth << " m, column " << u;
    }
  }
  LeftView near(wall_at(0.29));  // a disparity of 128.6
  near.settings.range_min = 0.1;
  for (const Return& made : near.depths(0, false)) EXPECT_FALSE(made.is_return());
}

TEST(StereoCamera, WhatTheRightImagerDoesNotSeeHasNoDepth) {
  // a wall, and before it a box, a ball and a pole thinner than its shift
  ShapeScene scene = wall_at(4.0);
  scene.add_box({1.5, -0.2, -0.4}, {1.8, 0.5, 0.3});
  scene.shapes.push_back(SceneSphere{{2.5, -1.0, 0.2}, 0.4});
  scene.add_box({1.2, -0.62, -2}, {1.23, -0.6, 2});
  const LeftView view(scene);
  const std::vector<Return> returns = view.depths(0, false);
  const Vector3d right(0.0, -0.095, 0.0);
  std::size_t hidden = 0;
  std::size_t wrong = 0;
  std::size_t looked_at = 0;
  for (std::size_t i = 0; i < returns.size(); ++i) {
    if (!view.hits[i].is_return()) continue;
    const Vector3d place = static_cast<double>(view.hits[i].range) * view.directions[i];
    const double column = static_cast<double>(i % 640) - kFocalBaseline / place.x();
    if (column < 1.0) continue;
    ++looked_at;
    const Vector3d way = place - right;
    const auto met = scene.intersect(right, way.normalized());
    const bool is_hidden = met && *met < way.norm() - 0.02;
    hidden += is_hidden ? 1 : 0;
    wrong += is_hidden == returns[i].is_return() ? 1 : 0;
  }
  EXPECT_GT(hidden, 5000u);
  // a column at each edge, as pixels have it
  EXPECT_LT(wrong, looked_at / 150);
  EXPECT_LT(wrong, hidden / 6);
}

TEST(StereoCamera, KeysThatAMatcherHasNoUseForAreRefused) {
  const std::string camera =
      "range_max: 6\npattern: grid\ngrid: {projection: pinhole, columns: 8, rows: 8, fx: 9, fy: 9, "
      "cx: 4, cy: 4, stereo: {baseline: 0.1}}\n";
  EXPECT_EQ(parse_lidar(camera, "c.yaml").grid.stereo.baseline, 0.1);
  for (const char* more : {"optics: {divergence_horizontal_deg: 0.1}\n",
                           "optics: {divergence_vertical_deg: 0.1}\n",
                           "detection: {rated: [{reflectivity: 0.1, range: 5}]}\n"}) {
    testing::expect_contains(
        testing::error_of([&] { static_cast<void>(parse_lidar(camera + more, "c.yaml")); }),
        "has no effect beside grid.stereo");
  }
}

TEST(StereoCamera, GrazedSurfacesHaveNoDepth) {
  LeftView view(wall_at(2.0));
  for (std::size_t i = 0; i < view.hits.size(); ++i) {
    view.hits[i].cos_incidence = static_cast<float>(std::cos((i % 2 == 0 ? 74.0 : 76.0) * kDegree));
  }
  const std::vector<Return> returns = view.depths(0, false);
  for (std::size_t u = 100; u < 640; ++u) {
    EXPECT_EQ(returns[100 * 640 + u].is_return(), u % 2 == 0);
  }
}

TEST(StereoCamera, Statistics_ItsInfraredPictureIsLitByProjectorAndSun) {
  // a wall at 2 m on the left and one at 4 m on the right
  ShapeScene scene;
  scene.add_box({2.0, 0.0, -12}, {2.4, 12, 12});
  scene.add_box({4.0, -12, -12}, {4.4, 0.3, 12});
  const auto renderer = make_renderer("beam", Scene{testing::map_of(scene, 0.05)});
  const auto left_by_right = [&](double sun) {
    Surroundings surroundings;
    surroundings.sun_klx = sun;
    surroundings.reflectivity = 0.4;
    const Lidar camera(load_lidar("d455"), 0, nullptr, surroundings);
    const Scan scan = camera.take({}, PoseTrack(Pose{}), *renderer, Executor(2));
    EXPECT_EQ(scan.infrared.size(), 640u * 480u);
    const auto brightness = [&](double azimuth) {
      const auto column = static_cast<std::size_t>(326.69 - 392.57 * std::tan(azimuth));
      double sum = 0.0;
      for (std::size_t row = 236; row < 246; ++row) sum += scan.infrared[row * 640 + column];
      return sum / 10.0;
    };
    return brightness(0.2) / brightness(-0.2);
  };
  EXPECT_NEAR(left_by_right(0.0), 4.0, 0.1);  // by the square of the depth
  EXPECT_NEAR(left_by_right(100.0), (100 + 5 / 4.0) / (100 + 5 / 16.0), 0.03);
  // not if returns are not modelled, and not of LiDARs
  const Lidar ideal(load_lidar("d455"), 0);
  EXPECT_TRUE(ideal.take({}, PoseTrack(Pose{}), *renderer, Executor(2)).infrared.empty());
  const Lidar mid360(load_lidar("mid360"), 0, nullptr, Surroundings{});
  EXPECT_TRUE(mid360.take({}, PoseTrack(Pose{}), *renderer, Executor(2)).infrared.empty());
}

TEST(StereoCamera, AD455MeasuresByItWhereReturnsAreModelled) {
  ShapeScene scene;
  scene.add_box({3.0, -12, -12}, {3.4, 12, 12});
  const auto renderer = make_renderer("beam", Scene{testing::map_of(scene, 0.1)});
  const Lidar camera(load_lidar("d455"), 0, nullptr, Surroundings{});
  ScanRequest request;
  request.truth = true;
  std::vector<float> first;
  for (std::uint64_t index = 0; index < 2; ++index) {
    request.index = index;
    const Scan scan = camera.take(request, PoseTrack(Pose{}), *renderer, Executor(2));
    double squares = 0.0;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const ScanPoint& point = scan.points[i];
      EXPECT_GE(point.beam % 640, 12u);  // the band of a disparity of 12.4
      const double off = static_cast<double>(point.position_sensor.x()) - 3.0;
      squares += off * off;
      EXPECT_NEAR(scan.truth[i].range * point.position_sensor.x() / point.range, 3.0, 0.01);
      if (index == 0) first.push_back(point.range);
    }
    const auto count = static_cast<double>(scan.points.size());
    EXPECT_NEAR(count / static_cast<double>(scan.beams), 1.0 - 12.5 / 640.0, 0.001);
    // 0.08 px and a 32nd's rounding
    EXPECT_NEAR(std::sqrt(squares / count), 9.0 / kFocalBaseline * 0.0805, 0.002);
    if (index == 1) {
      EXPECT_NE(first[1000], scan.points[1000].range);  // noise of its own
    }
  }
}

}  // namespace
}  // namespace pointflight
