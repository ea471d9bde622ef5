// Wide beams as cones: against rays over their cross-sections, and the same bits however they go.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"
#include "pointflight/render/internal/cone_kernel.hpp"
#include "pointflight/render/internal/direction_order.hpp"
#include "tests/render/even_surfaces.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::EvenSurfaces;
using testing::map_of;

/// Beams into a window of the world, in rows, as LiDARs have them; from where a sensor that flies
/// is, or from one position.
struct WideScan {
  std::vector<Ray> rays;
  std::vector<Vector3f> across;

  WideScan(const Vector3d& from, double speed, double yaw, std::size_t rows, std::size_t columns) {
    for (std::size_t c = 0; c < columns; ++c) {
      for (std::size_t r = 0; r < rows; ++r) {
        const double azimuth = yaw + 0.015 * static_cast<double>(c);
        const double elevation = 0.011 * (static_cast<double>(r) - 0.5 * static_cast<double>(rows));
        const Vector3d d(std::cos(azimuth) * std::cos(elevation),
                         std::sin(azimuth) * std::cos(elevation),
                         std::sin(elevation));
        Ray ray;
        ray.origin_world = from + Vector3d(speed * 1e-4 * static_cast<double>(c), 0, 0);
        ray.direction_world = d.cast<float>().normalized();
        ray.range_max = 60.0f;
        rays.push_back(ray);
        across.push_back(
            Vector3d(-std::sin(azimuth), std::cos(azimuth), 0.0).cast<float>().normalized());
      }
    }
  }

  [[nodiscard]] WideBeams beams(const EchoReceiver& receiver,
                                std::size_t sub_rays,
                                std::span<Echoes> echoes) const {
    return {.across = across,
            .sigma_across = 0.0014f,
            .sigma_up = 0.0014f,
            .merge = 0.75f,
            .sub_rays = sub_rays,
            .receiver = &receiver,
            .echoes = echoes};
  }

  [[nodiscard]] std::vector<Echoes> echoes(const Renderer& renderer,
                                           const EchoReceiver& receiver,
                                           std::size_t sub_rays,
                                           std::span<const Body> bodies = {}) const {
    std::vector<Echoes> all(rays.size());
    RayBatch batch;
    batch.rays = rays;
    batch.range_max = 60.0f;
    batch.bodies = bodies;
    const RenderJob job{batch, {}, beams(receiver, sub_rays, all)};
    renderer.render({&job, 1}, Executor(2));
    return all;
  }
};

/// Posts of 2 to 8 cm at 2 to 9 m all around, within walls.
std::shared_ptr<const SurfelMap> grove() {
  static const auto map = [] {
    ShapeScene scene;
    scene.add_box({-10, -10, -2}, {10, 10, 3});
    const RandomStream random(4, StreamId::kTest, 0);
    for (std::uint64_t i = 0; i < 150; ++i) {
      const double distance = random.uniform(4 * i, 2.0, 9.0);
      const double angle = random.uniform(4 * i + 1, 0.0, 6.28);
      const double half = random.uniform(4 * i + 2, 0.01, 0.04);
      const Vector3d at(distance * std::cos(angle), distance * std::sin(angle), 0.0);
      scene.add_box(at - Vector3d(half, half, 2.0), at + Vector3d(half, half, 2.5));
    }
    return map_of(scene, 0.05);
  }();
  return map;
}

void expect_same(const Echoes& a, const Echoes& b, const std::string& what) {
  ASSERT_EQ(a.count, b.count) << what;
  for (std::size_t k = 0; k < a.count; ++k) {
    ASSERT_EQ(a.all[k].range, b.all[k].range) << what;
    ASSERT_EQ(a.all[k].reflectivity, b.all[k].reflectivity) << what;
    ASSERT_EQ(a.all[k].parts, b.all[k].parts) << what;
    ASSERT_EQ(a.all[k].depth, b.all[k].depth) << what;
    ASSERT_EQ(a.all[k].origin.surfel, b.all[k].origin.surfel) << what;
    ASSERT_EQ(a.all[k].origin.cos_incidence, b.all[k].origin.cos_incidence) << what;
  }
}

/// The echoes of beams that go down in an order of their own, so many in a call.
std::vector<Echoes> traced(const WideScan& scan,
                           const EchoReceiver& receiver,
                           const std::vector<std::uint32_t>& order,
                           std::size_t at_once) {
  std::vector<Echoes> echoes(scan.rays.size());
  const WideBeams wide = scan.beams(receiver, 0, echoes);
  const KernelMap map = kernel_map_of(*grove());
  const std::vector<MapRay> rays = map_rays(map, scan.rays);
  for (std::size_t from = 0; from < order.size(); from += at_once) {
    const std::span part = std::span(order).subspan(from, std::min(at_once, order.size() - from));
    trace_cones(*grove(), map, rays, part, wide);
  }
  return echoes;
}

TEST(Cones, Slow_TheSameBitsHoweverBeamsGoTogether) {
  for (const double speed : {0.0, 40.0}) {  // m/s
    const WideScan scan({0, 0, 0}, speed, 0.4, 24, 60);
    for (const bool takes_strongest : {false, true}) {
      const EvenSurfaces receiver(takes_strongest);
      std::vector<std::uint32_t> order =
          direction_order(std::span<const Ray>(scan.rays), Executor(1));
      const std::vector<Echoes> together = traced(scan, receiver, order, order.size());
      std::size_t mixed = 0;
      for (const Echoes& e : together) mixed += e.count > 1 ? 1 : 0;
      EXPECT_GT(mixed, 50u);
      const auto expect_all_same = [&](const std::vector<Echoes>& other, const std::string& what) {
        for (std::size_t i = 0; i < together.size(); ++i) expect_same(together[i], other[i], what);
      };
      expect_all_same(traced(scan, receiver, order, 1), "one by one");
      expect_all_same(traced(scan, receiver, order, 100), "by hundreds");
      std::iota(order.begin(), order.end(), 0u);
      expect_all_same(traced(scan, receiver, order, 1024), "in rows");
      const RandomStream random(3, StreamId::kTest, 0);
      for (std::size_t i = order.size() - 1; i > 0; --i) {
        const auto k = static_cast<std::size_t>(random.uniform(i) * static_cast<double>(i + 1));
        std::swap(order[i], order[k]);
      }
      expect_all_same(traced(scan, receiver, order, order.size()), "in no order");
    }
  }
}

TEST(Cones, Slow_TheSameBitsByEveryInstructionSet) {
  const WideScan scan({0, 0, 0}, 40.0, 2.0, 24, 60);
  const EvenSurfaces receiver;
  const std::vector<std::uint32_t> order =
      direction_order(std::span<const Ray>(scan.rays), Executor(1));
  const std::vector<Echoes> best = traced(scan, receiver, order, order.size());
  for (const std::string& kernel : kernel_names()) {
    use_kernel(kernel);
    const std::vector<Echoes> others = traced(scan, receiver, order, order.size());
    for (std::size_t i = 0; i < best.size(); ++i) expect_same(best[i], others[i], kernel);
  }
  use_kernel("");
}

/// How much of the light lies in other echoes, of a beam and of its reference.
double share_error(const Echoes& found, const Echoes& expected) {
  double worst = 0.0;
  std::array<bool, Echoes::kMost> used{};
  for (const Echo& e : expected.span()) {
    std::size_t best = Echoes::kMost;
    for (std::size_t k = 0; k < found.count; ++k) {
      if (!used[k] && std::abs(found.all[k].range - e.range) < 0.4f) best = k;
    }
    const double there =
        best < Echoes::kMost ? static_cast<double>(found.all[best].reflectivity) : 0.0;
    if (best < Echoes::kMost) used[best] = true;
    worst = std::max(worst, std::abs(there - static_cast<double>(e.reflectivity)));
  }
  for (std::size_t k = 0; k < found.count; ++k) {
    if (!used[k]) worst = std::max(worst, static_cast<double>(found.all[k].reflectivity));
  }
  return worst / 0.3;
}

TEST(Cones, Statistics_SharesOfMixedBeamsAreThoseOfAThousandSubRays) {
  const auto renderer = make_renderer("beam", Scene{grove()});
  const EvenSurfaces receiver;
  std::vector<double> errors;
  for (const double yaw : {0.0, 1.5, 3.0, 4.5}) {
    const WideScan scan({0, 0, 0}, 10.0, yaw, 24, 40);
    const auto found = scan.echoes(*renderer, receiver, 0);
    const auto expected = scan.echoes(*renderer, receiver, 1000);
    for (std::size_t i = 0; i < found.size(); ++i) {
      const bool is_mixed = expected[i].count > 1 || found[i].count > 1 ||
                            (expected[i].count == 1 && expected[i].all[0].depth > 0.4f);
      if (is_mixed) errors.push_back(share_error(found[i], expected[i]));
    }
  }
  ASSERT_GT(errors.size(), 300u);
  std::sort(errors.begin(), errors.end());
  const double mean =
      std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size());
  EXPECT_LT(mean, 0.025);
  EXPECT_LT(errors[errors.size() * 95 / 100], 0.08);
}

TEST(Cones, OnWallsAndGrazedFloorsTheyAreAsFarAsRays) {
  ShapeScene scene;
  scene.add_box({-8, -8, -1.5}, {8, 8, 4});
  const auto renderer = make_renderer("beam", Scene{map_of(scene, 0.1)});
  const EvenSurfaces receiver;
  // all around: every axis of the map is the beams' own in turn
  for (double yaw = 0.0; yaw < 6.2; yaw += 0.7) {
    const WideScan scan({1, 0.5, 0}, 0.0, yaw, 60, 40);
    const auto found = scan.echoes(*renderer, receiver, 0);
    for (std::size_t i = 0; i < found.size(); ++i) {
      const float line = renderer->trace(scan.rays[i]).range;
      if (line < 0.0f) continue;  // a gap in a corner
      ASSERT_EQ(found[i].count, 1u) << yaw << ", beam " << i;
      ASSERT_NEAR(found[i].all[0].range, line, 0.05) << yaw << ", beam " << i;
    }
  }
}

TEST(Cones, BodiesCoverThemAndShareThem) {
  ShapeScene scene;
  scene.add_box({-8, -8, -8}, {8, 8, 8});
  const auto renderer = make_renderer("beam", Scene{map_of(scene, 0.1)});
  Body ball;
  ball.shape = Sphere{0.3};
  ball.label = kFirstObstacle;
  ball.motion = PoseTrack(Pose{Quaterniond::Identity(), {4, 0.3, 0}});
  const EvenSurfaces receiver;
  const WideScan scan({0, 0, 0}, 0.0, -0.1, 40, 40);
  const std::span<const Body> bodies(&ball, 1);
  const auto found = scan.echoes(*renderer, receiver, 0, bodies);
  const auto expected = scan.echoes(*renderer, receiver, 1000, bodies);
  const auto without = scan.echoes(*renderer, receiver, 0);
  std::size_t covered = 0;
  std::size_t mixed = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (expected[i].count == 1 && expected[i].all[0].label == kMapLabel) {
      ASSERT_EQ(found[i].count, 1u) << i;
      ASSERT_NEAR(found[i].all[0].range, without[i].all[0].range, 0.001) << i;
      continue;
    }
    ASSERT_LT(share_error(found[i], expected[i]), 0.15) << i;
    covered += expected[i].count == 1 ? 1 : 0;
    mixed += expected[i].count > 1 ? 1 : 0;
    EXPECT_TRUE(expected[i].count > 1 || found[i].all[0].label == ball.label) << i;
  }
  EXPECT_GT(covered, 50u);
  EXPECT_GT(mixed, 10u);
  // behind the wall nobody sees it, and nothing changes
  ball.motion = PoseTrack(Pose{Quaterniond::Identity(), {9, 0.3, 0}});
  const auto hidden = scan.echoes(*renderer, receiver, 0, bodies);
  for (std::size_t i = 0; i < hidden.size(); ++i) {
    ASSERT_EQ(hidden[i].count, without[i].count) << i;
    ASSERT_TRUE(hidden[i].all_hit) << i;
    ASSERT_EQ(hidden[i].all[0].range, without[i].all[0].range) << i;
    ASSERT_EQ(hidden[i].all[0].parts, without[i].all[0].parts) << i;
  }
}

/// A cloud of dust so fine that one wide beam passes thousands of surfels.
std::shared_ptr<const SurfelMap> dust(std::uint64_t points) {
  std::vector<Vector3d> all;
  const RandomStream random(9, StreamId::kTest, 0);
  for (std::uint64_t i = 0; i < points; ++i) {
    const auto [x, y] = random.uniform2(2 * i);
    const auto [z, unused] = random.uniform2(2 * i + 1);
    static_cast<void>(unused);
    all.emplace_back(4.0 + 4.0 * x, 4.0 * y - 2.0, 4.0 * z - 2.0);
  }
  return map_of(all, 0.05);
}

/// Sixteen beams through it, `at_once` in a call.
std::vector<Echoes> through_dust(const SurfelMap& map, float sigma, std::size_t at_once) {
  const EvenSurfaces receiver;
  WideScan scan({0, 0, 0}, 0.0, 0.0, 4, 4);
  std::vector<Echoes> echoes(scan.rays.size());
  WideBeams wide = scan.beams(receiver, 0, echoes);
  wide.sigma_across = wide.sigma_up = sigma;
  const std::vector<std::uint32_t> order =
      direction_order(std::span<const Ray>(scan.rays), Executor(1));
  const KernelMap kernel_map = kernel_map_of(map);
  const std::vector<MapRay> rays = map_rays(kernel_map, scan.rays);
  for (std::size_t from = 0; from < order.size(); from += at_once) {
    trace_cones(map, kernel_map, rays, std::span(order).subspan(from, at_once), wide);
  }
  return echoes;
}

void expect_echoes_of_dust(const std::vector<Echoes>& echoes) {
  std::size_t seen = 0;
  for (const Echoes& e : echoes) {
    for (const Echo& echo : e.span()) {
      EXPECT_GT(echo.range, 3.9f);
      EXPECT_LT(echo.range, 8.5f);
      EXPECT_LE(echo.reflectivity, 0.301f);
    }
    seen += e.count;
  }
  EXPECT_GT(seen, 8u);
}

TEST(Cones, OfTooManySurfelsEightRaysAreTaken) {
  expect_echoes_of_dust(through_dust(*dust(480000), 0.09f, 16));
}

TEST(Cones, CrowdedBeamsAreTheSameTogetherAndAlone) {
  const auto map = dust(120000);
  for (const float sigma : {0.01f, 0.02f, 0.04f}) {
    const std::vector<Echoes> together = through_dust(*map, sigma, 16);
    const std::vector<Echoes> alone = through_dust(*map, sigma, 1);
    for (std::size_t i = 0; i < together.size(); ++i) expect_same(together[i], alone[i], "in dust");
    expect_echoes_of_dust(together);
  }
}

TEST(Cones, AnEmptyMapGivesNoEchoes) {
  const auto map = map_of(std::vector<Vector3d>{{100, 100, 100}}, 0.1);
  const auto renderer = make_renderer("beam", Scene{map});
  const WideScan scan({0, 0, 0}, 0.0, 0.0, 3, 3);
  for (const Echoes& e : scan.echoes(*renderer, EvenSurfaces(), 0)) EXPECT_EQ(e.count, 0u);
}

}  // namespace
}  // namespace pointflight
