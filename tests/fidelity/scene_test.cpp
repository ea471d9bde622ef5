#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>

#include "pointflight/fidelity/scene_beams.hpp"
#include "pointflight/scenes/exact_scene.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::TemporaryFolder;
using testing::write_file;

/// What an exact renderer would say, moved by an offset or silent.
class ExactRenderer : public Renderer {
 public:
  ExactRenderer(const ExactScene& scene, float offset, bool silent)
      : scene_(scene), offset_(offset), silent_(silent) {}

 protected:
  void render_one(const RenderJob& job, const Executor& /*executor*/) const override {
    const std::span<Hit> hits = job.hits;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      const Ray& ray = job.batch.rays[i];
      const auto t =
          scene_.geometry.intersect(ray.origin_world, ray.direction_world.cast<double>());
      hits[i] = {};
      if (t && *t <= static_cast<double>(ray.range_max) && !silent_) {
        hits[i].range = static_cast<float>(*t) + offset_;
      }
    }
  }

 private:
  const ExactScene& scene_;
  float offset_;
  bool silent_;
};

BeamPlan few_beams() {
  BeamPlan plan;
  plan.poses = 2;
  plan.aimed_beams = 500;
  return plan;
}

TEST(ExactScene, EveryShippedSceneLoadsAndCanBeLookedAt) {
  const Executor executor(2);
  for (const auto& [name, about] : scene_names()) {
    const ExactScene scene = load_scene(name);
    EXPECT_EQ(scene.name, name);
    EXPECT_EQ(scene.shape_tag.size(), scene.geometry.shapes.size());
    const SceneBeams beams = cast_exactly(scene, few_beams(), executor);
    EXPECT_EQ(beams.per_pose(), 500u) << name;
    const auto met = std::count_if(
        beams.beams.begin(), beams.beams.end(), [](const TrueBeam& b) { return b.range >= 0.0f; });
    EXPECT_GT(met, 100) << name;
  }
  EXPECT_EQ(load_scene("hall").poses.size(), 8u);
  EXPECT_EQ(load_scene("forest").geometry.shapes.size(), 62273u + 64800u);
}

TEST(ExactScene, TheExactRendererIsExact) {
  const Executor executor(1);
  const ExactScene scene = load_scene("partition_5cm");
  const SceneBeams beams = cast_exactly(scene, few_beams(), executor);
  const auto exact = measure_fidelity(scene, beams, ExactRenderer(scene, 0.0f, false), executor);
  EXPECT_EQ(exact.all.rays, beams.beams.size());
  EXPECT_EQ(exact.interior.rays + exact.silhouette.rays, exact.all.rays);
  EXPECT_GT(exact.interior.rays, 500u);
  EXPECT_GT(exact.silhouette.rays, 1u);
  EXPECT_EQ(exact.all.wrong_fraction, 0.0);
  EXPECT_EQ(exact.all.missing_fraction, 0.0);
  EXPECT_EQ(exact.all.false_fraction, 0.0);
  EXPECT_LT(exact.all.p95_abs_error, 1e-6);

  const auto early = measure_fidelity(scene, beams, ExactRenderer(scene, -0.2f, false), executor);
  const double share_met = early.all.early_fraction;
  EXPECT_GT(share_met, 0.5);
  EXPECT_EQ(early.all.leak_fraction(), 0.0);
  const auto late = measure_fidelity(scene, beams, ExactRenderer(scene, 0.2f, false), executor);
  EXPECT_EQ(late.all.leak_fraction(), share_met);
  const auto silent = measure_fidelity(scene, beams, ExactRenderer(scene, 0.0f, true), executor);
  EXPECT_EQ(silent.all.missing_fraction, share_met);
  EXPECT_EQ(silent.all.false_fraction, 0.0);
}

TEST(ExactScene, SilhouettesAreWhereTheRangeJumps) {
  const ExactScene scene = load_scene("wire_pole");
  const SceneBeams beams = cast_exactly(scene, few_beams(), Executor(1));
  for (const TrueBeam& beam : beams.beams) {
    // every beam that meets a wire has the wall beside it
    if (beam.range >= 0.0f && scene.tags[beam.tag] == "wire 3 mm") {
      EXPECT_TRUE(beam.silhouette);
    }
  }
  // a slanted plane is none, however grazing
  const ExactScene floor = load_scene("grazing_floor");
  const SceneBeams on_floor = cast_exactly(floor, few_beams(), Executor(1));
  std::size_t grazing = 0;
  for (const TrueBeam& beam : on_floor.beams) {
    const Vector3d p = beam.ray.origin_world +
                       static_cast<double>(beam.range) * beam.ray.direction_world.cast<double>();
    // at 1 degree the rays beside it end metres away: not near the floor's edges
    if (beam.range < 0.0f || p.x() < 1.0 || p.x() > 20.0 || std::abs(p.y()) > 4.0) continue;
    grazing += beam.cos_incidence < 0.1f ? 1 : 0;
    ASSERT_FALSE(beam.silhouette) << p.transpose();
  }
  EXPECT_GT(grazing, 50u);
}

TEST(ExactScene, ACloudHasThePointsThatWereAskedFor) {
  const ExactScene scene = load_scene("thinning_wall");
  SceneSampling sampling;
  sampling.resolution = 0.05;
  sampling.points_per_cell = 8.0;
  const auto reader = sampled_cloud(scene, sampling);
  std::vector<CloudPoint> batch;
  std::vector<std::size_t> counts(7, 0);
  while (reader->read(batch)) {
    EXPECT_LE(batch.size(), 65536u);
    for (const CloudPoint& p : batch) ++counts[static_cast<std::size_t>(p.position.y() / 4.0)];
  }
  EXPECT_EQ(reader->share_read(), 1.0);
  const std::vector<double> per_cell = {16, 8, 4, 2.5, 1.3, 0.6, 0.2};
  for (std::size_t i = 0; i < counts.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(counts[i]), per_cell[i] * 12.0 / 0.0025, 2.0) << i;
  }
}

TEST(ExactScene, NoiseMovesPointsAlongTheNormal) {
  const ExactScene scene = load_scene("grazing_floor");
  SceneSampling sampling;
  sampling.resolution = 0.2;
  sampling.density_min = 0.0;
  sampling.noise = 0.01;
  const auto reader = sampled_cloud(scene, sampling);
  std::vector<CloudPoint> batch;
  double sum = 0.0;
  double count = 0.0;
  while (reader->read(batch)) {
    for (const CloudPoint& p : batch) sum += p.position.z() * p.position.z();
    count += static_cast<double>(batch.size());
  }
  EXPECT_NEAR(std::sqrt(sum / count), 0.01, 0.0002);
}

TEST(ExactScene, ASceneOfOnesOwnIsRead) {
  const TemporaryFolder folder;
  write_file(folder / "room.csv",
             "shape,tag,x0,y0,z0,x1,y1,z1,x2,y2,z2,r0,r1\n"
             "# a comment\r\n"
             "cone,pole,0,0,0,0,0,3,,,,0.1,0.1\n"
             "disc,plate,2,0,1,1,0,0,,,,0.5\n"
             "triangle,wall,5,-5,0,5,5,0,5,0,5\n");
  const ExactScene scene = load_scene(folder / "room.csv");
  EXPECT_EQ(scene.name, "room");
  EXPECT_EQ(scene.tags, (std::vector<std::string>{"pole", "plate", "wall"}));
  const auto t = scene.geometry.intersect({-2, 0, 1}, Vector3d::UnitX());
  ASSERT_TRUE(t);
  EXPECT_NEAR(*t, 1.9, 1e-12);
}

TEST(ExactScene, BadScenesSayFileAndLine) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& name, const std::string& text) {
    write_file(folder / name, text);
    return error_of([&] { load_scene(folder / name); });
  };
  expect_contains(error("a.csv", "blob,x,0,0,0\n"), "a.csv: line 1: 'blob' is no shape");
  expect_contains(error("b.csv", "\ndisc,x,0,0,zero\n"), "b.csv: line 2: 'zero' is not a number");
  expect_contains(error("c.csv", "disc,x\n"), "2 columns");
  expect_contains(error("d.csv", "cone,x,0,0,0,0,0,0,,,,1,1\n"), "needs an axis");
  expect_contains(error("e.csv", "disc,x,0,0,0,0,0,1,,,,-1\n"), "radius r0 above 0");
  expect_contains(error("f.csv", "shape,tag\n"), "no shapes");
  expect_contains(error("g.csv", "disc,x,nan,0,0,0,0,1,,,,1\n"), "not a number");
  expect_contains(error("h.csv.xz", "no xz at all"), "damaged or cut off xz data");
  expect_contains(error_of([] { load_scene("hal"); }), "known: hall, forest, yard, box");
}

TEST(ExactScene, AThinnedCloudHasOnePointACube) {
  const ExactScene scene = load_scene("box");
  SceneSampling sampling;
  sampling.resolution = 0.1;
  const auto count_of = [&] {
    const auto reader = sampled_cloud(scene, sampling);
    std::vector<CloudPoint> batch;
    std::map<std::array<std::int64_t, 3>, std::size_t> cells;
    std::size_t points = 0;
    while (reader->read(batch)) {
      for (const CloudPoint& p : batch) {
        const Vector3d cell = (p.position / 0.1).array() + 0.19;
        std::array<std::int64_t, 3> key{};
        for (std::size_t k = 0; k < 3; ++k) {
          key[k] = static_cast<std::int64_t>(std::floor(cell[static_cast<int>(k)]));
        }
        ++cells[key];
        ++points;
      }
    }
    return std::pair(points, cells.size());
  };
  const auto [all, occupied] = count_of();
  sampling.one_per_cell = true;
  const auto [kept, kept_cells] = count_of();
  EXPECT_GT(all, 5 * occupied);
  EXPECT_EQ(kept, occupied);
  EXPECT_EQ(kept_cells, occupied);
}

}  // namespace
}  // namespace pointflight
