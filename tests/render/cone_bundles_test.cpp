// Whole scans of wide beams: the same echoes in bundles and alone.
#include <gtest/gtest.h>

#include <numeric>

#include "pointflight/lidar/lidar.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

bool are_same_echoes(const Echoes& a, const Echoes& b) {
  if (a.count != b.count || a.all_hit != b.all_hit) return false;
  return std::equal(
      a.span().begin(), a.span().end(), b.span().begin(), [](const Echo& x, const Echo& y) {
        return x.range == y.range && x.reflectivity == y.reflectivity &&
               x.intensity == y.intensity && x.parts == y.parts && x.depth == y.depth &&
               x.origin.cos_incidence == y.origin.cos_incidence &&
               x.origin.surfel == y.origin.surfel && x.origin.sub_ray == y.origin.sub_ray;
      });
}

/// Beams in an order in which neighbours look elsewhere, so that each goes alone.
std::vector<std::uint32_t> scattered(std::size_t count) {
  std::vector<std::uint32_t> order;
  const std::size_t parts = 7;
  const std::size_t stride = (count + parts - 1) / parts;
  for (std::size_t i = 0; i < stride; ++i) {
    for (std::size_t k = 0; k < parts; ++k) {
      const std::size_t beam = k * stride + (i + k * 131) % stride;
      if (beam < count) order.push_back(static_cast<std::uint32_t>(beam));
    }
  }
  return order;
}

/// Scans of a sensor that flies and turns.
void expect_the_same_alone(const std::shared_ptr<const SurfelMap>& map,
                           const std::string& sensor,
                           int scans) {
  const BeamRenderer renderer(Scene{map});
  const Lidar lidar(load_lidar(sensor), 0, nullptr, Surroundings{});
  const Executor executor(2);
  const Aabb& box = map->bounds_world();
  std::size_t different = 0;
  std::size_t beams = 0;
  for (int k = 0; k < scans; ++k) {
    const double part = (k + 0.5) / scans;
    const Vector3d from =
        box.min + Vector3d(part, 0.8 - 0.6 * part, 0.3).cwiseProduct(box.max - box.min);
    std::vector<TimedPose> records;
    for (int i = 0; i <= 200; ++i) {
      const double t = 1e-3 * i;
      const Eigen::AngleAxisd turned(2.0 * t + k, Vector3d(0.1, -0.2, 1.0).normalized());
      records.push_back(
          {SimTime{} + from_seconds(t), {Quaterniond(turned), from + t * Vector3d(2.0, 1.0, 0.3)}});
    }
    const PoseTrack track(std::move(records));
    ScanRequest request;
    request.seed = static_cast<std::uint64_t>(k);
    const auto exposure = lidar.aim(request, track, renderer, executor);
    const RenderJob job = exposure->job();
    renderer.render({&job, 1}, executor);
    const std::vector<Echoes> together(job.wide->echoes.begin(), job.wide->echoes.end());
    const std::vector<std::uint32_t> order = scattered(together.size());
    ASSERT_EQ(order.size(), together.size());
    renderer.finish_cones(job, order, executor);
    for (std::size_t i = 0; i < together.size(); ++i) {
      different += are_same_echoes(together[i], job.wide->echoes[i]) ? 0 : 1;
    }
    beams += together.size();
  }
  EXPECT_EQ(different, 0u) << sensor << ", of " << beams;
}

TEST(ConeBundles, Slow_ScansHaveTheEchoesOfBeamsAlone) {
  ForestOptions forest;
  forest.size_x = 24.0;
  forest.size_y = 20.0;
  const auto map = testing::map_of(make_forest(forest), 0.1, 3.0, 0.01);
  expect_the_same_alone(map, "mid360", testing::repeats(10));
  expect_the_same_alone(map, "avia", testing::repeats(10));
  expect_the_same_alone(map, "vlp16", testing::repeats(10));
  expect_the_same_alone(map, "os1_128", testing::repeats(10));
}

}  // namespace
}  // namespace pointflight
