#include "pointflight/lidar/footprint.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/render/beam_kernel.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

/// All surfaces are of 30 %.
Surroundings even_surfaces() {
  Surroundings where;
  where.reflectivity = 0.3;
  return where;
}

using testing::map_of;

constexpr double kFwhm = 2.3548;  // sigmas

LidarSettings sensor(const std::string& name, std::int64_t sub_rays, ReturnMode mode) {
  LidarSettings settings = load_lidar(name);
  settings.optics.sub_rays = sub_rays;
  settings.detection.false_alarm = 0.0;
  settings.detection.returns = mode;
  return settings;
}

/// Beams from the origin along x: each `y` rad beside the axis.
std::vector<Ray> beams_beside(std::span<const double> places) {
  std::vector<Ray> rays;
  for (const double y : places) {
    Ray ray;
    ray.direction_world = Vector3d(1.0, y, 0.0).cast<float>().normalized();
    ray.range_max = 100.0f;
    rays.push_back(ray);
  }
  return rays;
}

/// `count` places spread evenly over +-`half`.
std::vector<double> even(double half, std::size_t count) {
  std::vector<double> places;
  for (std::size_t i = 0; i < count; ++i) {
    places.push_back(half *
                     (2.0 * (static_cast<double>(i) + 0.5) / static_cast<double>(count) - 1.0));
  }
  return places;
}

std::vector<Echoes> echoes_at(const LidarSettings& settings,
                              const std::vector<Ray>& rays,
                              const Renderer& renderer,
                              std::size_t threads = 1) {
  const Footprint footprint(settings.optics);
  const ReturnModel returns(settings, even_surfaces());
  const std::vector<Vector3f> across(rays.size(), Vector3f::UnitY());
  std::vector<Echoes> echoes(rays.size());
  RayBatch batch;
  batch.rays = rays;
  batch.range_max = 100.0f;
  footprint.trace({batch, across}, renderer, returns, echoes, Executor(static_cast<int>(threads)));
  return echoes;
}

/// Exactly two walls across x: one at `near` for y < 0, one at `far` for all.
class TwoWalls : public Renderer {
 public:
  TwoWalls(double near, double far) : near_(near), far_(far) {}
  void render(const RayBatch& batch, std::span<Hit> hits, const Executor&) const override {
    for (std::size_t i = 0; i < hits.size(); ++i) hits[i] = trace(batch.rays[i]);
  }
  [[nodiscard]] Hit trace(const Ray& ray) const override {
    const double per_x = 1.0 / static_cast<double>(ray.direction_world.x());
    const bool is_near = ray.direction_world.y() < 0.0f;
    Hit hit;
    hit.range = static_cast<float>((is_near ? near_ : far_) * per_x);
    hit.cos_incidence = 1.0f;
    return hit;
  }

 private:
  double near_, far_;
};

/// Share of the cross-section (a Gaussian that ends at 2 sigma) with x < e sigma, by a sum.
double share_below(double e) {
  constexpr int kSteps = 4000;
  double below = 0.0;
  double all = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double x = -2.0 + 4.0 * (i + 0.5) / kSteps;
    const double height = std::erf(std::sqrt(std::max(0.0, 4.0 - x * x) / 2.0));
    const double light = std::exp(-0.5 * x * x) * height;
    all += light;
    below += x < e ? light : 0.0;
  }
  return below / all;
}

TEST(Footprint, SharesAtAnEdgeAreThoseOfTheGaussian) {
  // by the map's own sub-rays and by so many as it takes, against an independent sum
  const TwoWalls walls(20.0, 25.0);
  for (const std::int64_t sub_rays : {0, 1000}) {
    const LidarSettings os1 = sensor("os1_32", sub_rays, ReturnMode::kDual);
    const double sigma = os1.optics.divergence_horizontal_deg * kDegree / kFwhm;
    const ReturnModel returns(os1, even_surfaces());
    const std::vector<double> places = even(2.5 * sigma, 500);
    const auto echoes = echoes_at(os1, beams_beside(places), walls);
    double worst = 0.0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double expected = share_below(-places[i] / sigma);
      double found = 0.0;
      for (const Echo& echo : echoes[i].span()) {
        if (echo.range < 22.0f) found += static_cast<double>(echo.reflectivity) / 0.3;
      }
      worst = std::max(worst, std::abs(found - expected));
    }
    // eight sub-rays where nothing hangs on more, within what they may be off
    EXPECT_LT(worst, sub_rays == 0 ? 0.15 : 0.01) << sub_rays;
  }
}

TEST(Footprint, AStepShallowerThanHalfAPulseGivesMixedRanges) {
  const TwoWalls walls(20.0, 20.5);
  const LidarSettings os1 = sensor("os1_32", 1000, ReturnMode::kDual);
  const double sigma = os1.optics.divergence_horizontal_deg * kDegree / kFwhm;
  const std::vector<double> places = even(1.5 * sigma, 100);
  const auto echoes = echoes_at(os1, beams_beside(places), walls);
  for (std::size_t i = 0; i < places.size(); ++i) {
    ASSERT_EQ(echoes[i].count, 1u);
    // energy goes with 1 / range^2
    const double near = share_below(-places[i] / sigma) / (20.0 * 20.0);
    const double far = (1.0 - share_below(-places[i] / sigma)) / (20.5 * 20.5);
    const double expected = (20.0 * near + 20.5 * far) / (near + far);
    EXPECT_NEAR(echoes[i].all[0].range, expected, 0.004) << places[i] / sigma;
  }
  // a deeper one gives two echoes at their own ranges
  const TwoWalls deep(20.0, 21.0);
  const auto apart = echoes_at(os1, beams_beside(std::vector<double>{0.0}), deep);
  ASSERT_EQ(apart[0].count, 2u);
  EXPECT_NEAR(apart[0].all[0].range, 20.0, 0.001);
  EXPECT_NEAR(apart[0].all[1].range, 21.0, 0.001);
}

TEST(Footprint, OnOnePlaneItIsTheLine) {
  // a wall face on and a floor that beams graze at 3 degrees
  ShapeScene scene;
  scene.add_rectangle({20, -4, -2}, {0, 8, 0}, {0, 0, 6});
  scene.add_rectangle({2, -4, -0.8}, {18, 0, 0}, {0, 8, 0});
  const auto renderer = make_renderer("beam", Scene{map_of(scene, 0.1)});
  const LidarSettings os1 = sensor("os1_32", 0, ReturnMode::kDual);
  std::vector<Ray> rays;
  for (int i = 0; i < 400; ++i) {
    Ray ray;
    const double down = i < 200 ? 0.02 : -0.055;
    ray.direction_world = Vector3d(1.0, 0.0005 * (i % 200 - 100), down).cast<float>().normalized();
    ray.range_max = 100.0f;
    rays.push_back(ray);
  }
  const auto echoes = echoes_at(os1, rays, *renderer);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const float line = renderer->trace(rays[i]).range;
    ASSERT_EQ(echoes[i].count, 1u) << i;
    // the floor's lit patch is 0.9 m long, and its near end gives more light
    EXPECT_NEAR(echoes[i].all[0].range, line, i < 200 ? 0.01 : 0.12) << i;
  }
}

/// Share of beams from which only the first, only the last, both of two echoes come back.
struct Shares {
  double first = 0.0, last = 0.0, both = 0.0;
};

Shares shares_of(const LidarSettings& settings,
                 const std::vector<Ray>& rays,
                 const Renderer& renderer,
                 float between) {
  const auto echoes = echoes_at(settings, rays, renderer);
  const ReturnModel returns(settings, even_surfaces());
  const RandomStream random(5, StreamId::kTest, 0);
  Shares shares;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    std::array<Return, 3> seen;
    const auto chance_of = [&](std::size_t echo) {
      BeamChance chance;
      chance.detection = random.uniform(8 * i + echo);
      return chance;
    };
    const std::size_t count = returns.measure(echoes[i].span(), chance_of, seen);
    bool first = false;
    bool last = false;
    for (std::size_t k = 0; k < count; ++k) (seen[k].true_range < between ? first : last) = true;
    const double one = 1.0 / static_cast<double>(rays.size());
    shares.first += first && !last ? one : 0.0;
    shares.last += last && !first ? one : 0.0;
    shares.both += first && last ? one : 0.0;
  }
  return shares;
}

void expect_shares_of_a_thousand(const std::string& name,
                                 const Renderer& renderer,
                                 double distance) {
  const double sigma = load_lidar(name).optics.divergence_horizontal_deg * kDegree / kFwhm;
  const std::vector<Ray> rays = beams_beside(even(3.0 * sigma + 0.01 / distance, 3000));
  const auto between = static_cast<float>(distance + 1.0);
  const Shares found = shares_of(sensor(name, 0, ReturnMode::kDual), rays, renderer, between);
  const Shares expected = shares_of(sensor(name, 1000, ReturnMode::kDual), rays, renderer, between);
  EXPECT_NEAR(found.first, expected.first, 0.02) << name << " at " << distance << " m";
  EXPECT_NEAR(found.last, expected.last, 0.02) << name << " at " << distance << " m";
  EXPECT_NEAR(found.both, expected.both, 0.02) << name << " at " << distance << " m";
  EXPECT_GT(expected.both, 0.2) << name << " at " << distance << " m";
}

TEST(Footprint, EdgesGiveTheSharesOfAThousandSubRays) {
  ShapeScene scene;
  scene.add_rectangle({23, -2, -1}, {0, 4, 0}, {0, 0, 2});
  scene.add_rectangle({20, 0, -1}, {0, 2, 0}, {0, 0, 2});
  const auto renderer = make_renderer("beam", Scene{map_of(scene, 0.02)});
  for (const char* name : {"os1_128", "mid360", "vlp32c"}) {
    expect_shares_of_a_thousand(name, *renderer, 20.0);
  }
}

TEST(Footprint, WiresOfFourMillimetresGiveTheSharesOfAThousandSubRays) {
  for (const double distance : {5.0, 10.0, 20.0}) {
    ShapeScene scene;
    scene.add_rectangle({distance + 5.0, -2, -1}, {0, 4, 0}, {0, 0, 2});
    std::vector<Vector3d> points;
    scene.sample(20.0 / (0.02 * 0.02), 0.0, 1, [&](const Vector3d& p) { points.push_back(p); });
    const RandomStream random(1, StreamId::kTest, 0);
    for (std::uint64_t i = 0; i < 40000; ++i) {
      const auto [turn, height] = random.uniform2(i);
      points.emplace_back(distance + 0.002 * std::cos(2.0 * kPi * turn),
                          0.002 * std::sin(2.0 * kPi * turn),
                          -1.0 + 2.0 * height);
    }
    const auto renderer = make_renderer("beam", Scene{map_of(points, 0.02)});
    for (const char* name : {"os1_128", "mid360", "vlp32c"}) {
      expect_shares_of_a_thousand(name, *renderer, distance);
    }
  }
}

TEST(Footprint, TheSameBytesWithAnyThreadsAndInstructionSet) {
  const auto renderer =
      make_renderer("beam", Scene{map_of(make_forest({.size_x = 12.0, .size_y = 12.0}), 0.1)});
  LidarSettings vlp = load_lidar("vlp16");
  vlp.detection.returns = ReturnMode::kTriple;
  const Lidar lidar(vlp, 0, nullptr, even_surfaces());
  // 4 m/s and 90 deg/s
  std::vector<TimedPose> poses;
  for (int ms = 0; ms <= 100; ++ms) {
    const double s = 1e-3 * ms;
    poses.push_back({SimTime(std::chrono::milliseconds(ms)),
                     {quaternion_from_rpy(0, 0, 0.5 * kPi * s), {6.0 + 4.0 * s, 6.0, 1.5}}});
  }
  const PoseTrack track(poses);
  const auto points_with = [&](int threads) {
    const Executor executor(threads);
    return lidar.take({}, track, *renderer, executor).points;
  };
  const auto one = points_with(1);
  EXPECT_GT(std::count_if(one.begin(), one.end(), [](const ScanPoint& p) { return p.echo > 0; }),
            20);
  const auto expect_same = [&](const std::vector<ScanPoint>& points, const std::string& what) {
    ASSERT_EQ(points.size(), one.size()) << what;
    for (std::size_t i = 0; i < one.size(); ++i) {
      ASSERT_EQ(points[i].range, one[i].range) << what << ", point " << i;
      ASSERT_EQ(points[i].echo, one[i].echo) << what << ", point " << i;
    }
  };
  expect_same(points_with(3), "3 threads");
  for (const std::string& kernel : kernel_names()) {
    use_kernel(kernel);
    expect_same(points_with(1), kernel);
  }
  use_kernel("");
}

BeamPart part(float range, float share, float reflectivity = 0.5f) {
  BeamPart made;
  made.range = range;
  made.share = share;
  made.reflectivity = reflectivity;
  return made;
}

TEST(Echoes, PartsWithinHalfAPulseAreOne) {
  std::vector<BeamPart> parts = {
      part(10.5f, 0.2f), part(10.0f, 0.2f), {}, part(30.0f, 0.1f), part(11.0f, 0.2f)};
  const Echoes echoes = echoes_of(parts, 0.6f);
  ASSERT_EQ(echoes.count, 2u);
  EXPECT_EQ(echoes.all[0].parts, 3u);
  EXPECT_NEAR(echoes.all[0].reflectivity, 0.3f, 1e-6f);
  EXPECT_NEAR(echoes.all[0].depth, 1.0f, 1e-6f);
  EXPECT_NEAR(echoes.all[1].reflectivity, 0.05f, 1e-6f);
  EXPECT_FLOAT_EQ(echoes.all[1].range, 30.0f);
}

TEST(Echoes, OfManyTheStrongestAreKeptInOrder) {
  std::vector<BeamPart> parts;
  for (int i = 0; i < 7; ++i) {
    parts.push_back(part(10.0f + 2.0f * static_cast<float>(i), i == 1 || i == 2 ? 0.01f : 0.16f));
  }
  const Echoes echoes = echoes_of(parts, 0.6f);
  ASSERT_EQ(echoes.count, Echoes::kMost);
  EXPECT_FLOAT_EQ(echoes.all[0].range, 10.0f);
  EXPECT_FLOAT_EQ(echoes.all[1].range, 16.0f);
  EXPECT_FLOAT_EQ(echoes.all[2].range, 18.0f);
  EXPECT_FLOAT_EQ(echoes.all[3].range, 20.0f);
}

TEST(ReturnModel, ModesReportWhatMakersSay) {
  // a twig at 5 m, leaves at 8 m, a wall at 20 m: the leaves are the strongest
  std::array<Echo, 3> echoes;
  echoes[0] = {5.0f, 0.01f, 0.0f, kMapLabel, 1};
  echoes[1] = {8.0f, 0.2f, 0.0f, kMapLabel, 1};
  echoes[2] = {20.0f, 0.3f, 0.0f, kMapLabel, 1};
  const auto ranges = [&](ReturnMode mode, std::span<const Echo> seen) {
    LidarSettings os1 = sensor("os1_32", 0, mode);
    os1.noise = {};
    const ReturnModel model(os1, even_surfaces());
    std::array<Return, 3> returns;
    const std::size_t count = model.measure(
        seen, [](std::size_t) { return BeamChance{}; }, returns);
    EXPECT_LE(count, most_returns(mode));
    std::vector<float> made;
    for (std::size_t i = 0; i < count; ++i) made.push_back(returns[i].range);
    return made;
  };
  using Ranges = std::vector<float>;
  EXPECT_EQ(ranges(ReturnMode::kStrongest, echoes), (Ranges{8.0f}));
  EXPECT_EQ(ranges(ReturnMode::kFirst, echoes), (Ranges{5.0f}));
  EXPECT_EQ(ranges(ReturnMode::kLast, echoes), (Ranges{20.0f}));
  EXPECT_EQ(ranges(ReturnMode::kDual, echoes), (Ranges{8.0f, 20.0f}));
  // the strongest is the last: the second strongest besides
  EXPECT_EQ(ranges(ReturnMode::kDual, std::span(echoes).first(2)), (Ranges{8.0f, 5.0f}));
  EXPECT_EQ(ranges(ReturnMode::kTriple, echoes), (Ranges{8.0f, 20.0f, 5.0f}));
  EXPECT_EQ(ranges(ReturnMode::kTriple, {}), Ranges{});
}

TEST(Footprint, FilesKeepTheEchoes) {
  const testing::TemporaryFolder folder;
  ShapeScene scene;
  scene.add_box({-8, -8, -2}, {8, 8, 4});
  scene.add_box({3, -1, -2}, {3.2, 1, 4});
  const auto map = map_of(scene, 0.1);
  const auto renderer = make_renderer("beam", Scene{map});
  LidarSettings vlp = load_lidar("vlp16");
  vlp.detection.returns = ReturnMode::kDual;
  const Lidar lidar(vlp, 0, nullptr, even_surfaces());
  const Executor executor(1);
  const Scan scan = lidar.take({}, PoseTrack(Pose{}), *renderer, executor);
  ASSERT_TRUE(scan.marks.echoes);
  write_scan_pcd(folder / "s.pcd", scan);
  const auto back = read_scan_points(
      folder / "s.pcd", lidar.beams(lidar.pattern_scan(0, 0), executor), scan.marks);
  ASSERT_EQ(back.size(), scan.points.size());
  std::size_t further = 0;
  for (std::size_t i = 0; i < back.size(); ++i) {
    ASSERT_EQ(back[i].echo, scan.points[i].echo);
    ASSERT_EQ(back[i].beam, scan.points[i].beam);
    further += back[i].echo > 0 ? 1 : 0;
  }
  EXPECT_GT(further, 20u);
}

}  // namespace
}  // namespace pointflight
