#include "pointflight/scenes/surface_notes.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/render/renderer.hpp"
#include "pointflight/scenes/scene_builder.hpp"
#include "pointflight/scenes/scene_class.hpp"
#include "pointflight/scenes/scene_tree.hpp"
#include "pointflight/scenes/world_map.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

ImportedMap map_of(const ExactScene& scene, double resolution, int threads = 2) {
  SceneSampling sampling;
  sampling.points_per_cell = 6.0;
  sampling.resolution = resolution;
  sampling.density_min = 0.0;
  sampling.with_mirrors = true;
  ImportOptions import;
  import.resolution = resolution;
  import.outliers.enabled = false;
  const Executor executor(threads);
  ImportedMap made = build_map(
      {scene.name}, [&](std::size_t) { return sampled_cloud(scene, sampling); }, import, executor);
  note_surfaces(scene, made.tree, made.description, executor);
  return made;
}

std::shared_ptr<const SurfelMap> opened(const ImportedMap& made) {
  return SurfelMap::from_bytes(map_bytes(made.tree, made.description), "scene");
}

/// A room with a window, a net across it and a bush.
ExactScene room_with_things() {
  SceneBuilder to(3);
  to.begin("floor");
  to.rectangle({-5, -5, 0}, {10, 0, 0}, {0, 10, 0});
  to.begin("wall");
  to.rectangle({5, -5, 0}, {0, 10, 0}, {0, 0, 3});
  to.begin("glass");
  to.rectangle({-5, -5, 0}, {0, 10, 0}, {0, 0, 3});
  to.begin("net");
  for (int i = 0; i <= 80; ++i) {
    const double at = -5.0 + 0.125 * i;
    to.rod({at, 3, 0}, {at, 3, 3}, 0.004);
    if (i <= 24) to.rod({-5, 3, 0.125 * i}, {5, 3, 0.125 * i}, 0.004);
  }
  to.begin("bush");
  for (int i = 0; i < 400; ++i) {
    const double x = to.between(2.0, 3.0);
    const double y = to.between(-3.0, -2.0);
    const double z = to.between(0.1, 1.1);
    const double tilt = to.between(-1.0, 1.0);
    to.disc({x, y, z}, Vector3d(tilt, 1.0 - tilt, 1.0), 0.04);
  }
  Aabb free;
  free.add({-1, -1, 1});
  free.add({1, 1, 2});
  ExactScene scene = to.finish(free);
  scene.name = "room with things";
  return scene;
}

TEST(SurfaceNotes, SurfelsAreLabelledByWhatRaysHit) {
  const ExactScene scene = room_with_things();
  const auto map = opened(map_of(scene, 0.1));
  const auto& names = map->notes().class_names();
  ASSERT_EQ(names.size(), scene_classes().size() + 1);
  std::size_t known = 0;
  map->for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t word) {
    const SurfelLabel label = map->notes().label(word);
    if (label.kind == 0) return;  // between leaves
    ++known;
    // away from where things touch each other
    if (p.z() < 0.05 && std::abs(p.y() - 3.0) > 0.2 && std::abs(p.x()) < 4.8) {
      EXPECT_EQ(names[label.kind], "floor");
      EXPECT_EQ(label.thing, 1u);
    }
    if (p.x() > 4.95 && p.z() > 0.2 && std::abs(p.y() - 3.0) > 0.2) {
      EXPECT_EQ(names[label.kind], "wall");
    }
    if (p.z() > 0.2 && p.x() > 1.9 && p.x() < 3.1 && p.y() < -1.5) {
      EXPECT_EQ(names[label.kind], "bush");
      EXPECT_EQ(label.thing, 5u);
    }
    if (p.x() < -4.95 && p.z() > 0.2 && std::abs(p.y() - 3.0) > 0.2) {
      EXPECT_EQ(names[label.kind], "glass");
      EXPECT_EQ(map->notes().opacity(word), Opacity::kPane);
    }
  });
  EXPECT_GT(static_cast<double>(known), 0.999 * static_cast<double>(map->surfel_count()));
}

TEST(SurfaceNotes, AreTheSameForAnyNumberOfThreads) {
  const ExactScene scene = room_with_things();
  const ImportedMap one = map_of(scene, 0.1, 1);
  const ImportedMap two = map_of(scene, 0.1, 2);
  EXPECT_EQ(map_bytes(one.tree, one.description), map_bytes(two.tree, two.description));
}

/// Root mean square, over cells of 2 degrees, of how far the share of rays that come back from nets
/// and leaves is off the exact one.
double error_of_shares(const ExactScene& scene, const std::shared_ptr<const SurfelMap>& map) {
  const auto renderer = make_renderer("beam", Scene{map});
  const SceneTree exact(scene);
  const auto is_thin = [](std::uint8_t kind) {
    return kind != 0 && scene_classes()[kind - 1U].is_thin;
  };
  constexpr int kSide = 8;
  std::vector<Ray> rays;
  for (int azimuth = 0; azimuth < 360; azimuth += 2) {
    for (int elevation = -20; elevation < 20; elevation += 2) {
      for (int i = 0; i < kSide * kSide; ++i) {
        const double a = (azimuth + 2.0 * (i % kSide + 0.5) / kSide) * kDegree;
        const double e = (elevation + 2.0 * (i / kSide + 0.5) / kSide) * kDegree;
        rays.push_back({{0.3, 0.2, 1.0}, unit_direction(a, e).cast<float>(), 30.0f});
      }
    }
  }
  std::vector<Hit> hits(rays.size());
  RayBatch batch;
  batch.rays = rays;
  renderer->render(batch, hits, Executor(0));
  double sum = 0.0;
  double cells = 0.0;
  for (std::size_t begin = 0; begin < rays.size(); begin += kSide * kSide) {
    double rendered = 0.0;
    double truth = 0.0;
    for (std::size_t i = begin; i < begin + kSide * kSide; ++i) {
      const auto hit =
          exact.intersect(rays[i].origin_world, rays[i].direction_world.cast<double>());
      if (hit && is_thin(class_number(scene.tags[scene.shape_tag[hit->shape]]))) truth += 1.0;
      if (hits[i].is_return() && is_thin(map->notes().label(hits[i].surfel).kind)) rendered += 1.0;
    }
    if (truth == 0.0 && rendered == 0.0) continue;
    const double off = (rendered - truth) / (kSide * kSide);
    sum += off * off;
    cells += 1.0;
  }
  return std::sqrt(sum / cells);
}

// what opacity is there for
TEST(SurfaceNotes, NetsAndLeavesSendBackTheShareThatTheyDo) {
  const ExactScene scene = room_with_things();
  ImportedMap made = map_of(scene, 0.1);
  const double clear = error_of_shares(scene, opened(made));
  set_section(made.description, kOpacitySection, {});
  const double opaque = error_of_shares(scene, opened(made));
  EXPECT_LT(clear, 0.5 * opaque) << opaque;
}

TEST(SurfaceNotes, MapsOfWorldsSayWhatTheyAre) {
  const auto map = open_world_map({{"large_office", 1, {}}, 0.2}, Executor(0));
  EXPECT_TRUE(map->notes().has_labels());
  EXPECT_TRUE(map->has_intensity());
  EXPECT_DOUBLE_EQ(map->reflectivity_per_intensity(), 0.01);
  std::size_t panes = 0;
  map->for_each_surfel([&](const Vector3d&, const Vector3d&, double, std::uint32_t word) {
    panes += map->notes().opacity(word) == Opacity::kPane ? 1 : 0;
    const double reflectivity = 0.01 * static_cast<double>(map->intensity(word));
    EXPECT_GT(reflectivity, 0.01);
    EXPECT_LT(reflectivity, 0.95);
  });
  EXPECT_GT(panes, 100u);
}

}  // namespace
}  // namespace pointflight
