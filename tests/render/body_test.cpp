#include <gtest/gtest.h>

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "pointflight/render/internal/paper_renderer.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::map_of;

/// A room of 10 m with the origin in its middle.
std::shared_ptr<const SurfelMap> room() {
  static const auto map = [] {
    ShapeScene scene;
    scene.add_box({-5, -5, -5}, {5, 5, 5});
    return map_of(scene, 0.1);
  }();
  return map;
}

/// Something of each shape that moves in a straight line and turns.
std::vector<Body> moving_bodies(std::uint32_t seed, int count) {
  const RandomStream random(11, StreamId::kTest, seed);
  std::vector<Body> bodies;
  for (int i = 0; i < count; ++i) {
    const auto draw = [&](int k, double low, double high) {
      return random.uniform(static_cast<std::uint64_t>(16 * i + k), low, high);
    };
    Body body;
    body.label = kFirstObstacle + static_cast<Label>(i);
    body.intensity = static_cast<float>(10 + i);
    const Solid solids[4] = {Sphere{draw(0, 0.1, 0.5)},
                             Box{{draw(1, 0.1, 0.5), draw(2, 0.1, 0.5), draw(3, 0.1, 0.5)}},
                             Cylinder{draw(4, 0.1, 0.4), draw(5, 0.1, 0.6)},
                             Capsule{draw(6, 0.1, 0.3), draw(7, 0.1, 0.5)}};
    body.shape = solids[i % 4];
    const Vector3d start(draw(8, -4, 4), draw(9, -4, 4), draw(10, -4, 4));
    const Vector3d velocity(draw(11, -9, 9), draw(12, -9, 9), draw(13, -9, 9));
    const Vector3d spin(draw(14, -9, 9), draw(15, -9, 9), 3.0);
    body.speed_max = velocity.norm();
    std::vector<TimedPose> poses;
    for (int ms = 0; ms <= 100; ++ms) {
      const double s = 1e-3 * ms;
      poses.push_back({SimTime(std::chrono::milliseconds(ms)),
                       {quaternion_from_rotation_vector(s * spin), start + s * velocity}});
    }
    body.motion = PoseTrack(std::move(poses));
    if (i % 5 == 0) body.until = SimTime(from_seconds(0.07));  // gone within the scan
    bodies.push_back(body);
  }
  return bodies;
}

/// Rays all around, over a scan of 0.1 s, from a sensor that flies.
struct Shots {
  std::vector<Ray> rays;
  std::vector<Duration> offsets;

  explicit Shots(std::size_t count, double speed = 5.0) {
    for (std::size_t i = 0; i < count; ++i) {
      const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
      offsets.push_back(from_seconds(0.1 * share));
      const double z = 1 - 2 * share;
      const double turn = 2.4 * static_cast<double>(i);
      const double side = std::sqrt(1 - z * z);
      Ray ray;
      ray.origin_world = Vector3d(speed * 0.1 * share, 0, 0);
      ray.direction_world =
          Vector3d(side * std::cos(turn), side * std::sin(turn), z).cast<float>().normalized();
      ray.range_max = 12.0f;
      rays.push_back(ray);
    }
  }
  [[nodiscard]] RayBatch batch(std::span<const Body> bodies) const {
    RayBatch b;
    b.rays = rays;
    b.range_max = 12.0f;
    b.bodies = bodies;
    b.time_offsets = offsets;
    b.snapshot_time = SimTime(from_seconds(0.05));
    b.image_resolution = 0.3 * kDegree;
    return b;
  }
};

TEST(Bodies, Statistics_AreSeenWhereTheyAreAtEachBeamsOwnTime) {
  const BeamRenderer renderer({room()});
  const Shots shots(20000);
  const Executor executor(2);
  for (std::uint32_t seed = 0; seed < 8; ++seed) {
    // many bodies are looked for by blocks of neighbouring rays
    const auto bodies = moving_bodies(seed, seed == 7 ? 300 : 24);
    std::vector<Hit> with(shots.rays.size());
    std::vector<Hit> without(shots.rays.size());
    renderer.render(shots.batch(bodies), with, executor);
    renderer.render(shots.batch({}), without, executor);
    int seen = 0;
    for (std::size_t i = 0; i < with.size(); ++i) {
      // by brute force
      const SimTime time{shots.offsets[i]};
      Hit expected = without[i];
      for (const Body& body : bodies) {
        if (time >= body.until) continue;
        const Pose T_body_world = body.T_world_body(time).inverse();
        const Vector3d d =
            (T_body_world.rotation * shots.rays[i].direction_world.cast<double>()).normalized();
        const auto met =
            intersect(std::get<Solid>(body.shape), T_body_world * shots.rays[i].origin_world, d);
        if (!met || (expected.is_return() && static_cast<float>(met->range) >= expected.range)) {
          continue;
        }
        expected.range = static_cast<float>(met->range);
        expected.intensity = body.intensity;
        expected.label = body.label;
      }
      ASSERT_EQ(with[i].range, expected.range) << seed << " " << i;
      ASSERT_EQ(with[i].label, expected.label);
      ASSERT_TRUE(with[i].label == kMapLabel || with[i].surfel == kNoSurfel);
      ASSERT_EQ(with[i].intensity, expected.intensity);
      seen += expected.label != kMapLabel ? 1 : 0;
    }
    EXPECT_GT(seen, 200);
  }
}

TEST(Bodies, OfPointsFollowTheSameRuleAsTheMap) {
  // a ball of points that moves beside an exact one at the same position
  ShapeScene scene;
  scene.shapes.emplace_back(SceneSphere{Vector3d::Zero(), 0.5});
  const auto points = map_of(scene, 0.05);
  Body body;
  body.label = kFirstObstacle;
  body.shape = points;
  body.speed_max = 10.0;
  std::vector<TimedPose> poses;
  for (int ms = 0; ms <= 100; ++ms) {
    poses.push_back({SimTime(std::chrono::milliseconds(ms)),
                     {quaternion_from_rpy(0, 0, 0.02 * ms), {-3, 0.01 * ms, 0.5}}});
  }
  body.motion = PoseTrack(std::move(poses));
  Body exact = body;
  exact.shape = Solid{Sphere{0.5}};
  const BeamRenderer renderer({room()});
  const Shots shots(60000);
  const Executor executor(2);
  std::vector<Hit> of_points(shots.rays.size());
  std::vector<Hit> of_ball(shots.rays.size());
  renderer.render(shots.batch({&body, 1}), of_points, executor);
  renderer.render(shots.batch({&exact, 1}), of_ball, executor);
  int both = 0;
  int one = 0;
  double sum = 0.0;
  for (std::size_t i = 0; i < of_ball.size(); ++i) {
    const bool a = of_points[i].label != kMapLabel;
    const bool b = of_ball[i].label != kMapLabel;
    one += a != b ? 1 : 0;
    if (!a || !b) continue;
    ++both;
    sum += std::abs(of_points[i].range - of_ball[i].range);
  }
  EXPECT_GT(both, 300);
  EXPECT_LT(one, both / 5);  // its outline
  EXPECT_LT(sum / both, 0.01);
}

TEST(Bodies, AreDrawnAsPointsInThePapersImage) {
  const auto bodies = moving_bodies(3, 12);
  const BeamRenderer beam({room()});
  const PaperRenderer paper({room()}, {});
  const Shots shots(40000, 0.0);
  const Executor executor(2);
  // all at one instant, as the image is
  std::vector<Body> frozen = bodies;
  for (Body& body : frozen) {
    const Pose pose = body.T_world_body(SimTime(from_seconds(0.05)));
    body.motion = PoseTrack(pose);
    body.until = SimTime::max();
  }
  std::vector<Hit> exact(shots.rays.size());
  std::vector<Hit> drawn(shots.rays.size());
  beam.render(shots.batch(frozen), exact, executor);
  paper.render(shots.batch(frozen), drawn, executor);
  int seen = 0;
  int same = 0;
  double error = 0.0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    if (exact[i].label == kMapLabel) continue;
    ++seen;
    if (drawn[i].label != exact[i].label) continue;
    ++same;
    EXPECT_EQ(drawn[i].intensity, exact[i].intensity);
    error += std::abs(drawn[i].range - exact[i].range);
  }
  EXPECT_GT(seen, 500);
  EXPECT_GT(same, 0.95 * seen);  // points fill a little more than the shape
  EXPECT_LT(error / same, 0.1);
}

}  // namespace
}  // namespace pointflight
