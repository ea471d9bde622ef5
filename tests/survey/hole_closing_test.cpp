// Holes in floors and walls are closed, doors and windows are not.
#include "pointflight/survey/hole_closing.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "pointflight/core/random.hpp"
#include "pointflight/map/edit/map_edit.hpp"
#include "pointflight/render/renderer.hpp"
#include "pointflight/survey/survey_hits.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::map_of;

/// Rays held in memory.
class HeldRays : public SurveyReader {
 public:
  explicit HeldRays(const std::vector<SurveyRay>& rays) : rays_(rays) {}
  bool read(std::vector<SurveyRay>& batch) override {
    batch = done_ ? std::vector<SurveyRay>{} : rays_;
    done_ = true;
    return !batch.empty();
  }
  [[nodiscard]] double share_read() const override { return done_ ? 1.0 : 0.0; }

 private:
  const std::vector<SurveyRay>& rays_;
  bool done_ = false;
};

std::shared_ptr<const SurfelMap> opened_edit(const EditedMap& map) {
  return SurfelMap::from_bytes(map_bytes(map.tree, map.description), "edited");
}

/// A box of the world.
bool lies_in(const Vector3d& p, const Vector3d& low, const Vector3d& high) {
  return (p.array() >= low.array()).all() && (p.array() <= high.array()).all();
}

/// A room of 6 x 5 x 2.8 m with a door of 0.9 x 2.1 m and a window of 1.2 x 1 m in its wall at x =
/// 6, and a wall 3 m behind that.
ShapeScene room_with_door() {
  ShapeScene scene;
  scene.add_rectangle({0, 0, 0}, {6, 0, 0}, {0, 5, 0});
  scene.add_rectangle({0, 0, 2.8}, {6, 0, 0}, {0, 5, 0});
  scene.add_rectangle({0, 0, 0}, {6, 0, 0}, {0, 0, 2.8});
  scene.add_rectangle({0, 5, 0}, {6, 0, 0}, {0, 0, 2.8});
  scene.add_rectangle({0, 0, 0}, {0, 5, 0}, {0, 0, 2.8});
  // door: y from 0.6 to 1.5; window: y from 3 to 4.2, z from 1 to 2
  scene.add_rectangle({6, 0, 0}, {0, 0.6, 0}, {0, 0, 2.8});
  scene.add_rectangle({6, 0.6, 2.1}, {0, 0.9, 0}, {0, 0, 0.7});
  scene.add_rectangle({6, 1.5, 0}, {0, 1.5, 0}, {0, 0, 2.8});
  scene.add_rectangle({6, 3, 0}, {0, 1.2, 0}, {0, 0, 1});
  scene.add_rectangle({6, 3, 2}, {0, 1.2, 0}, {0, 0, 0.8});
  scene.add_rectangle({6, 4.2, 0}, {0, 0.8, 0}, {0, 0, 2.8});
  scene.add_rectangle({9, -3, -1}, {0, 11, 0}, {0, 0, 5});
  return scene;
}

/// No point lies in these: a strip of the floor, 0.8 m wide, and a patch of the wall at y = 5.
bool is_left_bare(const Vector3d& p) {
  return lies_in(p, {2.4, -1, -0.1}, {3.2, 6, 0.1}) || lies_in(p, {2, 4.9, 1}, {2.8, 5.1, 1.8});
}

/// Rays from three positions to wherever the scene is, but for what is left bare.
std::vector<SurveyRay> rays_in(const ShapeScene& scene, std::size_t count) {
  const RandomStream random(7, StreamId::kSurvey, 0);
  std::vector<SurveyRay> rays;
  for (std::uint64_t i = 0; rays.size() < count; ++i) {
    const auto [around, up] = random.uniform2(i);
    const double azimuth = 2.0 * 3.14159265358979 * around;
    const double z = 2.0 * up - 1.0;
    const double flat = std::sqrt(1.0 - z * z);
    const Vector3d direction(flat * std::cos(azimuth), flat * std::sin(azimuth), z);
    const Vector3d origin(1.2 + 0.9 * static_cast<double>(i % 3), 2.5, 1.4);
    const auto range = scene.intersect(origin, direction);
    if (!range || is_left_bare(origin + *range * direction)) continue;
    rays.push_back(survey_ray({Quaterniond::Identity(), origin}, *range * direction, true));
  }
  return rays;
}

std::shared_ptr<const SurfelMap> bare_map(const ShapeScene& scene) {
  std::vector<Vector3d> points;
  scene.sample(1500.0, 0.003, 1, [&](const Vector3d& p) {
    if (!is_left_bare(p)) points.push_back(p);
  });
  return map_of(points, 0.1);
}

EditedMap closed(const SurfelMap& map,
                 const std::vector<SurveyRay>& rays,
                 ClosingReport& report,
                 int threads = 2) {
  return close_holes(
      map, [&] { return std::make_unique<HeldRays>(rays); }, {}, {}, Executor(threads), report);
}

std::vector<Vector3d> assumed_in(const SurfelMap& map) {
  std::vector<Vector3d> centers;
  map.for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t word) {
    if (map.is_assumed(word)) centers.push_back(p);
  });
  return centers;
}

Hit hit_in(const std::shared_ptr<const SurfelMap>& map, const Vector3d& from, const Vector3d& to) {
  const auto renderer = make_renderer("beam", Scene{map});
  return renderer->trace({from, (to - from).normalized().cast<float>(), 30.0f});
}

TEST(HoleClosing, ClosesFloorsAndWallsAndLeavesDoorsAndWindowsOpen) {
  const ShapeScene scene = room_with_door();
  const auto bare = bare_map(scene);
  const auto rays = rays_in(scene, 60000);
  ClosingReport report;
  const auto map = opened_edit(closed(*bare, rays, report));
  const auto assumed = assumed_in(*map);
  EXPECT_EQ(assumed.size(), report.assumed);
  EXPECT_GT(assumed.size(), 300u);  // the strip alone has 400 cells
  std::size_t on_floor = 0;
  std::size_t on_wall = 0;
  for (const Vector3d& p : assumed) {
    EXPECT_FALSE(lies_in(p, {5.8, 0.65, 0.05}, {6.2, 1.45, 2.05})) << "door: " << p.transpose();
    EXPECT_FALSE(lies_in(p, {5.8, 3.05, 1.05}, {6.2, 4.15, 1.95})) << "window: " << p.transpose();
    on_floor += std::abs(p.z()) < 0.02 && p.x() > 2.3 && p.x() < 3.3 ? 1 : 0;
    on_wall += std::abs(p.y() - 5.0) < 0.02 && p.x() > 1.9 && p.x() < 2.9 ? 1 : 0;
  }
  EXPECT_GT(on_floor, 300u);
  EXPECT_GT(on_wall, 40u);
  EXPECT_GT(on_floor + on_wall, assumed.size() * 9 / 10);
  // what was open is closed, and says so; what is open stays so
  const Vector3d eye(2.5, 2.5, 1.4);
  for (const Vector3d& hole :
       {Vector3d(2.8, 1.0, 0), Vector3d(2.8, 4.0, 0), Vector3d(2.4, 5, 1.4)}) {
    EXPECT_FALSE(hit_in(bare, eye, hole).is_return());
    const Hit hit = hit_in(map, eye, hole);
    EXPECT_NEAR(hit.range, (hole - eye).norm(), 0.02);
    EXPECT_TRUE(map->is_assumed(hit.surfel));
  }
  for (const Vector3d& opening : {Vector3d(6, 1.05, 1.0), Vector3d(6, 3.6, 1.5)}) {
    const Hit hit = hit_in(map, eye, opening);
    EXPECT_NEAR(hit.range, (opening - eye).norm() * 6.5 / 3.5, 0.05);
    EXPECT_FALSE(map->is_assumed(hit.surfel));
  }
}

TEST(HoleClosing, NoRayOfTheSurveyPassesWhatIsAssumed) {
  const ShapeScene scene = room_with_door();
  const auto rays = rays_in(scene, 30000);
  ClosingReport report;
  const auto map = opened_edit(closed(*bare_map(scene), rays, report));
  ASSERT_TRUE(map->has_assumed());
  std::atomic<std::size_t> passes{0};
  follow_survey(
      *map,
      [&] { return std::make_unique<HeldRays>(rays); },
      0.1,
      Executor(2),
      "",
      {},
      [&](const SurveyRay& ray, const RayHits& way) {
        for (const SurfelHit& hit : way.hits) {
          if (map->is_assumed(hit.word) && hit.weight > 0 && hit.t < ray.range - 0.1f) {
            ++passes;
          }
        }
      });
  EXPECT_EQ(passes, 0u);
}

TEST(HoleClosing, TheMarksStayWithTheirSurfels) {
  const ShapeScene scene = room_with_door();
  const auto rays = rays_in(scene, 30000);
  ClosingReport report;
  const EditedMap made = closed(*bare_map(scene), rays, report);
  const auto map = opened_edit(made);
  const auto before = assumed_in(*map);
  ASSERT_FALSE(before.empty());
  const Executor executor(2);
  const auto half = opened_edit(crop_map(
      *map, [](const Vector3d& p) { return p.x() < 2.8; }, {}, executor));
  std::size_t expected = 0;
  for (const Vector3d& p : before) expected += p.x() < 2.8 ? 1 : 0;
  EXPECT_EQ(assumed_in(*half).size(), expected);
  Pose turn;
  turn.rotation = Quaterniond(std::cos(0.3), 0.0, 0.0, std::sin(0.3));
  turn.translation = {3, -2, 1};
  for (const Pose& T : {turn, Pose{Quaterniond::Identity(), Vector3d(1, 2, 3)}}) {
    const auto moved = assumed_in(*opened_edit(transform_map(*map, T, {}, executor)));
    ASSERT_EQ(moved.size(), before.size());
    double sum = 0.0;
    for (const Vector3d& p : moved) sum += p.z() - T.translation.z();
    for (const Vector3d& p : before) sum -= p.z();
    EXPECT_NEAR(sum / static_cast<double>(before.size()), 0.0, 0.01);
  }
  // what another map has seen is not assumed
  const auto seen = map_of(scene, 0.1, 15.0, 0.003);
  const auto both = opened_edit(merge_maps({{map, {}}, {seen, {}}}, {}, executor));
  EXPECT_EQ(assumed_in(*both).size(), before.size());
  const auto alone = opened_edit(merge_maps({{seen, {}}, {map, {}}}, {}, executor));
  EXPECT_LT(assumed_in(*alone).size(), before.size() / 10);
  // closed once more: nothing is left to close
  ClosingReport again;
  const auto twice = opened_edit(closed(*map, rays, again));
  EXPECT_NEAR(static_cast<double>(assumed_in(*twice).size()),
              static_cast<double>(before.size()),
              0.1 * static_cast<double>(before.size()));
}

TEST(HoleClosing, TheSameBytesForAnyNumberOfThreads) {
  const ShapeScene scene = room_with_door();
  const auto rays = rays_in(scene, 20000);
  const auto bare = bare_map(scene);
  ClosingReport report;
  const EditedMap one = closed(*bare, rays, report, 1);
  const EditedMap four = closed(*bare, rays, report, 4);
  EXPECT_EQ(map_bytes(one.tree, one.description), map_bytes(four.tree, four.description));
}

TEST(HoleClosing, WithoutPlanesNothingIsAssumed) {
  ShapeScene ball;
  ball.shapes.emplace_back(SceneSphere{{0, 0, 0}, 1.5});
  std::vector<SurveyRay> rays;
  ClosingReport report;
  const auto map = opened_edit(closed(*map_of(ball, 0.1, 8.0, 0.0), rays, report));
  EXPECT_EQ(report.planes, 0u);
  EXPECT_FALSE(map->has_assumed());
}

TEST(HoleClosing, ASectionOfTheWrongLengthIsCorrupt) {
  const ShapeScene scene = room_with_door();
  ClosingReport report;
  EditedMap made = closed(*bare_map(scene), rays_in(scene, 5000), report);
  set_section(made.description, kAssumedSection, std::vector<std::byte>(3));
  testing::expect_contains(testing::error_of([&] { opened_edit(made); }),
                           "the section 'assumed' is corrupt");
}

}  // namespace
}  // namespace pointflight
