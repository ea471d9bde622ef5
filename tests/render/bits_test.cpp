// The same bits from every build: maps and ten million beams a scene against recorded hashes. Where
// a change of the import or of the measurement model is meant to change them, run the test and put
// in what it prints; if it is not, the change has broken reproducibility.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/hash.hpp"
#include "pointflight/core/internal/simd_targets-inl.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/lidar/beam_pattern.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "pointflight/scenes/exact_scene.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kBatch = 100000;
#ifdef POINTFLIGHT_SANITIZED
constexpr bool kAll = false;  // the first 100,000 beams; they are slow there
#else
constexpr bool kAll = true;
#endif

struct Recorded {
  const char* scene;
  std::uint64_t map;
  std::uint64_t beams_1e5, beams_1e6, beams_1e7;
};

void PrintTo(const Recorded& recorded, std::ostream* out) {
  *out << recorded.scene;
}

constexpr Recorded kRecorded[] = {{"hall",
                                   17539116693610813141u,
                                   3940173689077779487u,
                                   6828965012094551286u,
                                   3293491058186207321u},
                                  {"forest",
                                   11867312887941650756u,
                                   7784435363323122930u,
                                   6910349985814777616u,
                                   433360125384573909u}};

std::vector<std::byte> map_of_scene(const ExactScene& scene) {
  SceneSampling sampling;
  sampling.resolution = 0.2;
  sampling.density_min = 100.0;
  ImportOptions options;
  options.resolution = 0.2;
  const Executor executor(0);
  const ImportedMap map = build_map(
      {scene.name}, [&](std::size_t) { return sampled_cloud(scene, sampling); }, options, executor);
  return map_bytes(map.tree, map.description);
}

/// Half of the beams fill a patch densely (they go as packets), half point anywhere; in every other
/// batch the sensor moves. Made with + * / sqrt only, so that the inputs are the same bits too.
std::vector<Ray> rays_of(const ExactScene& scene, std::size_t batch) {
  std::vector<Ray> rays(kBatch);
  const Vector3d at = scene.poses[batch % scene.poses.size()].translation;
  const double turn = 0.7548776662466927 * static_cast<double>(batch + 1);
  for (std::size_t i = 0; i < kBatch; ++i) {
    const auto n = static_cast<double>(i);
    Vector3d d;
    if (i % 2 == 0) {
      const double column = static_cast<double>(i / 2 % 250) / 250.0 - 0.5;
      const double row = static_cast<double>(i / 500) / 100.0 - 0.5;
      d = Vector3d(1.0, 0.8 * column + 0.3, 0.3 * row);
      // about z by a rational angle: (1 - s^2, 2 s) / (1 + s^2)
      const double s = 4.0 * (turn - std::floor(turn)) - 2.0;
      const double c = (1.0 - s * s) / (1.0 + s * s);
      const double q = 2.0 * s / (1.0 + s * s);
      d = Vector3d(c * d.x() - q * d.y(), q * d.x() + c * d.y(), d.z());
    } else {
      // R3 sequence (Roberts 2018)
      const auto part = [&](double step) {
        const double x = turn + step * n;
        return 2.0 * (x - std::floor(x)) - 1.0;
      };
      d = Vector3d(part(0.8191725133961645), part(0.6710436067037893), part(0.5497004779019703));
      if (!(d.squaredNorm() > 1e-4)) d = Vector3d::UnitX();
    }
    rays[i].direction_world = (d / std::sqrt(d.squaredNorm())).cast<float>();
    rays[i].origin_world = at;
    if (batch % 2 == 1) rays[i].origin_world += Vector3d(2e-6 * n, -1e-6 * n, 1e-7 * n);
    rays[i].range_max = 60.0f;
  }
  return rays;
}

class Bits : public ::testing::TestWithParam<Recorded> {
 protected:
  void SetUp() override {
    scene_ = load_scene(GetParam().scene);
    map_ = SurfelMap::from_bytes(map_of_scene(scene_), scene_.name);
    const std::vector<std::uint64_t> parts = {hash64(std::as_bytes(map_->nodes())),
                                              hash64(std::as_bytes(map_->words()))};
    map_hash_ = hash64(as_bytes(parts));
  }

  /// Hash of the hits of the first `beams`.
  std::uint64_t hash_of(std::size_t beams, int threads, BeamGrouping grouping) {
    const BeamRenderer renderer(Scene{map_}, grouping);
    const Executor executor(threads);
    std::vector<std::uint64_t> hashes;
    std::vector<Hit> hits(kBatch);
    for (std::size_t batch = 0; batch * kBatch < beams; ++batch) {
      const std::vector<Ray> rays = rays_of(scene_, batch);
      RayBatch request;
      request.rays = rays;
      renderer.render(request, hits, executor);
      std::vector<float> numbers;
      numbers.reserve(3 * hits.size());
      for (const Hit& hit : hits) {
        numbers.insert(numbers.end(), {hit.range, hit.cos_incidence, hit.intensity});
      }
      hashes.push_back(hash64(as_bytes(numbers)));
    }
    EXPECT_EQ(renderer.overflow_count(), 0u);
    return hash64(as_bytes(hashes));
  }

  ExactScene scene_;
  std::shared_ptr<const SurfelMap> map_;
  std::uint64_t map_hash_ = 0;
};

TEST_P(Bits, Slow_AreThoseRecorded) {
#if defined(__x86_64__)
  const Recorded& recorded = GetParam();
  EXPECT_EQ(map_hash_, recorded.map) << "the map is another";
  EXPECT_EQ(hash_of(100000, 2, BeamGrouping::kAutomatic), recorded.beams_1e5);
  EXPECT_EQ(hash_of(100000, 1, BeamGrouping::kSingly), recorded.beams_1e5) << "singly";
  EXPECT_EQ(hash_of(100000, 1, BeamGrouping::kBundles), recorded.beams_1e5) << "bundles";
  if (kAll) {
    EXPECT_EQ(hash_of(10000000, 2, BeamGrouping::kAutomatic), recorded.beams_1e7);
  }
  const bool thorough = std::getenv("POINTFLIGHT_THOROUGH") != nullptr;  // by ./dev check
  for (const std::string& name : kernel_names()) {
    use_kernel(name);
    if (!kAll) {
      EXPECT_EQ(hash_of(100000, 3, BeamGrouping::kAutomatic), recorded.beams_1e5) << name;
      EXPECT_EQ(hash_of(100000, 3, BeamGrouping::kBundles), recorded.beams_1e5) << name;
    } else if (!thorough) {
      EXPECT_EQ(hash_of(1000000, 3, BeamGrouping::kAutomatic), recorded.beams_1e6) << name;
    } else {
      EXPECT_EQ(hash_of(10000000, 3, BeamGrouping::kAutomatic), recorded.beams_1e7) << name;
    }
  }
  use_kernel("");
#else
  GTEST_SKIP() << "recorded on x86-64";
#endif
}

std::uint64_t bits_of(const Renderer& renderer, const std::vector<Ray>& rays) {
  std::vector<Hit> hits(rays.size());
  RayBatch request;
  request.rays = rays;
  request.T_world_sensor.translation = rays.front().origin_world;
  renderer.render(request, hits, Executor(2));
  std::vector<float> numbers;
  for (const Hit& hit : hits) {
    numbers.insert(numbers.end(), {hit.range, hit.cos_incidence, hit.intensity});
  }
  return hash64(as_bytes(numbers));
}

// from dense to far apart, from rest to a sensor that moves by metres within a scan, in the open
// and amid surfels that lie around the apex
TEST(BeamRenderer, BundlesAreTheBitsOfSingleRays) {
  ShapeScene scene;
  scene.add_box({-4, -4, -2}, {4, 4, 2});
  scene.shapes.emplace_back(SceneSphere{{2, 2, 0}, 0.5});
  scene.shapes.emplace_back(Cone{{-1, 0.6, -2}, {-1, 0.6, 2}, 0.03, 0.03});
  const auto map = testing::map_of(scene, 0.05, 8.0, 0.01);
  const BeamRenderer bundles(Scene{map}, BeamGrouping::kBundles);
  const BeamRenderer suits(Scene{map});
  const BeamRenderer singly(Scene{map}, BeamGrouping::kSingly);
  const RandomStream random(7, StreamId::kTest, 0);
  std::uint64_t draw = 0;
  const auto next = [&](double low, double high) { return random.uniform(draw++, low, high); };
  for (const double width : {0.02, 0.2, 1.0, kPi}) {
    for (const double motion : {0.0, 1e-4, 0.05, 3.0}) {
      for (const Vector3d& at : {Vector3d(0.3, 0.2, 0.1), Vector3d(3.98, 3.99, -1.97)}) {
        const double heading = next(-kPi, kPi);
        const double elevation = next(-1.4, 1.4);
        std::vector<Ray> rays(777);
        for (Ray& ray : rays) {
          const double azimuth = heading + next(-width, width);
          const double up = std::clamp(elevation + next(-width, width), -1.57, 1.57);
          ray.direction_world = direction_of(azimuth, up).cast<float>();
          ray.origin_world = at;
          for (int axis = 0; axis < 3; ++axis) ray.origin_world[axis] += motion * next(-0.5, 0.5);
          ray.range_max = static_cast<float>(next(0.5, 20.0));
        }
        const auto expected = bits_of(singly, rays);
        EXPECT_EQ(bits_of(bundles, rays), expected) << width << " rad, " << motion << " m";
        EXPECT_EQ(bits_of(suits, rays), expected) << width << " rad, " << motion << " m";
      }
    }
  }
}

// of every compiler too: draws that are arguments of one call come in an order of its choice
TEST(GeneratedForest, IsTheOneRecorded) {
  std::vector<double> numbers;
  const auto put = [&](const Vector3d& v) { numbers.insert(numbers.end(), v.begin(), v.end()); };
  for (const Shape& shape : make_forest(ForestOptions{}).shapes) {
    if (const auto* triangle = std::get_if<Triangle>(&shape)) {
      for (const Vector3d& corner : {triangle->a, triangle->b, triangle->c}) put(corner);
    } else if (const auto* cone = std::get_if<Cone>(&shape)) {
      put(cone->from);
      put(cone->to);
      numbers.insert(numbers.end(), {cone->radius_from, cone->radius_to});
    } else if (const auto* disc = std::get_if<Disc>(&shape)) {
      put(disc->center);
      put(disc->normal);
      numbers.push_back(disc->radius);
    }
  }
#if defined(__x86_64__)
  EXPECT_EQ(hash64(as_bytes(numbers)), 15340897498394051763u);
#else
  GTEST_SKIP() << "recorded on x86-64";
#endif
}

INSTANTIATE_TEST_SUITE_P(Scenes, Bits, ::testing::ValuesIn(kRecorded), [](const auto& info) {
  return std::string(info.param.scene);
});

}  // namespace
}  // namespace pointflight
