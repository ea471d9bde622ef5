#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "pointflight/map/edit/map_edit.hpp"
#include "pointflight/render/renderer.hpp"
#include "tests/map/edited_map.hpp"
#include "tests/render/even_surfaces.hpp"
#include "tests/render/rays.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

constexpr double kCurtains[] = {4.0, 6.0};
constexpr double kBack = 10.0;

/// Two curtains at x = 4 and 6 m before a wall at x = 10 m; `opacity` is that of the curtains.
std::shared_ptr<const SurfelMap> curtains(std::uint8_t opacity) {
  ShapeScene scene;
  for (const double x : {kCurtains[0], kCurtains[1], kBack}) {
    scene.shapes.emplace_back(Triangle{{x, -9, -9}, {x, 9, -9}, {x, 9, 9}});
    scene.shapes.emplace_back(Triangle{{x, -9, -9}, {x, 9, 9}, {x, -9, 9}});
  }
  return testing::opened(testing::noted(*testing::map_of(scene, 0.1), [&](const Vector3d& p) {
    SurfelNote note;
    if (p.x() < 8.0) note.opacity = opacity;
    return note;
  }));
}

/// Shares of hits at the curtains and at the wall.
struct Shares {
  double first = 0.0;
  double second = 0.0;
  double wall = 0.0;
};

Shares shares_of(std::size_t count, const std::function<double(std::size_t)>& x_of) {
  Shares shares;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = x_of(i);
    const double one = 1.0 / static_cast<double>(count);
    if (std::abs(x - kCurtains[0]) < 0.02) shares.first += one;
    if (std::abs(x - kCurtains[1]) < 0.02) shares.second += one;
    if (std::abs(x - kBack) < 0.02) shares.wall += one;
  }
  return shares;
}

Shares shares_of(const std::vector<Ray>& rays, const std::vector<Hit>& hits) {
  return shares_of(hits.size(), [&](std::size_t i) {
    return static_cast<double>(hits[i].range * rays[i].direction_world.x());
  });
}

TEST(SeeThrough, EachCurtainSendsItsShareBack) {
  const auto renderer = make_renderer("beam", Scene{curtains(Opacity::of_share(0.4))});
  const std::vector<Ray> rays = testing::fan(Vector3d::Zero(), 30, 30, 0.5);
  const Shares shares = shares_of(rays, testing::render(*renderer, rays));
  // five standard deviations of a binomial
  const double n = static_cast<double>(rays.size());
  const auto within = [&](double p) { return 5.0 * std::sqrt(p * (1.0 - p) / n); };
  EXPECT_NEAR(shares.first, 0.4, within(0.4) + 0.002);  // in 255ths
  EXPECT_NEAR(shares.second, 0.24, within(0.24) + 0.002);
  EXPECT_NEAR(shares.wall, 0.36, within(0.36) + 0.002);
  EXPECT_NEAR(shares.first + shares.second + shares.wall, 1.0, 1e-9);
}

TEST(SeeThrough, DrawsAreTheBeamsOwn) {
  const auto renderer = make_renderer("beam", Scene{curtains(Opacity::of_share(0.5))});
  const std::vector<Ray> rays = testing::fan(Vector3d::Zero(), 20, 20, 1.0);
  const auto ranges_of = [&](const BeamDraws& draws, int threads, bool ranges_alone) {
    std::vector<Hit> hits(rays.size());
    std::vector<float> ranges(rays.size());
    RenderJob job;
    job.batch.rays = rays;
    job.batch.draws = draws;
    if (ranges_alone) {
      job.ranges = ranges;
    } else {
      job.hits = hits;
    }
    renderer->render({&job, 1}, Executor(threads));
    for (std::size_t i = 0; i < hits.size() && !ranges_alone; ++i) ranges[i] = hits[i].range;
    return ranges;
  };
  const auto once = ranges_of({7, 3, 100}, 1, false);
  EXPECT_EQ(once, ranges_of({7, 3, 100}, 2, false));
  EXPECT_EQ(once, ranges_of({7, 3, 100}, 2, true));
  EXPECT_NE(once, ranges_of({8, 3, 100}, 1, false));
  EXPECT_NE(once, ranges_of({7, 4, 100}, 1, false));
  EXPECT_NE(once, ranges_of({7, 3, 101}, 1, false));
}

TEST(SeeThrough, PanesReturnNearTheirNormalAndWaterLosesTheRest) {
  const std::vector<Ray> rays = testing::fan(Vector3d::Zero(), 35, 35, 1.0);
  const auto pane = testing::render(*make_renderer("beam", Scene{curtains(Opacity::kPane)}), rays);
  const auto water =
      testing::render(*make_renderer("beam", Scene{curtains(Opacity::kWater)}), rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const float cosine = rays[i].direction_world.x();
    if (std::abs(cosine - Opacity::kMirrorCosine) < 0.01f) continue;  // surfels' normals are coarse
    const bool is_near = cosine > Opacity::kMirrorCosine;
    EXPECT_NEAR(pane[i].range * cosine, is_near ? kCurtains[0] : kBack, 0.02);
    EXPECT_EQ(water[i].is_return(), is_near);
  }
}

TEST(SeeThrough, BodiesBehindAreSeen) {
  const auto renderer = make_renderer("beam", Scene{curtains(Opacity::of_share(0.01))});
  Body ball;
  ball.label = kFirstObstacle;
  ball.shape = Sphere{1.0};
  ball.motion = PoseTrack({{SimTime{}, {Quaterniond::Identity(), Vector3d(8, 0, 0)}}});
  const std::vector<Ray> rays = testing::fan(Vector3d::Zero(), 3, 3, 0.25);
  std::vector<Hit> hits(rays.size());
  RayBatch batch;
  batch.rays = rays;
  batch.bodies = {&ball, 1};
  renderer->render(batch, hits, Executor(1));
  std::size_t on_ball = 0;
  for (const Hit& hit : hits) on_ball += hit.label == kFirstObstacle ? 1 : 0;
  EXPECT_GT(on_ball, hits.size() * 9 / 10);
}

TEST(SeeThrough, EchoesOfWideBeamsComeBackInTheSameShares) {
  const auto renderer = make_renderer("beam", Scene{curtains(Opacity::of_share(0.4))});
  const testing::EvenSurfaces receiver;
  const std::vector<Ray> rays = testing::fan(Vector3d::Zero(), 30, 30, 0.5);
  std::vector<Vector3f> across;
  for (const Ray& ray : rays) {
    across.push_back(Vector3f::UnitZ().cross(ray.direction_world).normalized());
  }
  std::vector<Echoes> echoes(rays.size());
  RenderJob job;
  job.batch.rays = rays;
  job.wide = WideBeams{.across = across,
                       .sigma_across = 0.001f,
                       .sigma_up = 0.001f,
                       .merge = 0.5f,
                       .sub_rays = 0,
                       .receiver = &receiver,
                       .echoes = echoes};
  renderer->render({&job, 1}, Executor(2));
  const Shares shares = shares_of(rays.size(), [&](std::size_t i) {
    EXPECT_EQ(echoes[i].count, 1u);
    return static_cast<double>(echoes[i].all[0].range * rays[i].direction_world.x());
  });
  EXPECT_NEAR(shares.first, 0.4, 0.025);
  EXPECT_NEAR(shares.second, 0.24, 0.025);
  EXPECT_NEAR(shares.wall, 0.36, 0.025);
}

TEST(SeeThrough, MapsWithoutSuchSurfelsAreRenderedAsEver) {
  const auto map = curtains(Opacity::kOpaque);
  EXPECT_FALSE(map->notes().has_opacity());
  const auto renderer = make_renderer("beam", Scene{map});
  const std::vector<Ray> rays = testing::fan(Vector3d::Zero(), 20, 20, 1.0);
  EXPECT_NEAR(shares_of(rays, testing::render(*renderer, rays)).first, 1.0, 1e-9);
}

TEST(SeeThrough, RenderersOfImagesGoOnByRays) {
  const auto renderer = make_renderer("paper", Scene{curtains(Opacity::kPane)});
  EXPECT_TRUE(renderer->is_snapshot());
  const std::vector<Ray> rays = testing::fan(Vector3d::Zero(), 30, 20, 1.0);
  const std::vector<Hit> hits = testing::render(*renderer, rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const float cosine = rays[i].direction_world.x();
    if (cosine > 0.95f) continue;
    EXPECT_NEAR(hits[i].range * cosine, kBack, 0.05);
  }
}

}  // namespace
}  // namespace pointflight
