// Rays of aimed beams beside poses and rotations in double.
#include "pointflight/render/sensor_beams.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"
#include "pointflight/render/renderer.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

constexpr std::uint32_t kPieces = 10;

/// Beams all around, from origins up to 0.3 m away, at any time.
std::shared_ptr<const SensorBeams> some_beams(std::size_t count, bool has_origins) {
  const RandomStream random(3, StreamId::kTest, 0);
  auto made = std::make_shared<SensorBeams>();
  made->pieces = kPieces;
  made->has_origins = has_origins;
  for (std::uint32_t i = 0; made->beams.size() < count; ++i) {
    const std::uint64_t at = std::uint64_t{12} * i;
    Vector3d d(random.normal(at), random.normal(at + 1), random.normal(at + 2));
    if (i < 3) d = Vector3d::Unit(static_cast<int>(i));
    const Vector3f u = d.normalized().cast<float>();
    const Vector3f across = horizontal_across(u);
    SensorBeam beam{};
    for (int k = 0; k < 3; ++k) {
      beam.direction[k] = u[k];
      const auto axis = static_cast<std::uint64_t>(k);
      if (has_origins) {
        beam.origin[k] = static_cast<float>(random.uniform(at + 3 + axis, -0.3, 0.3));
      }
    }
    beam.across[0] = across.x();
    beam.across[1] = across.y();
    beam.stretch = 1.0f + 0.1f * static_cast<float>(i % 3);
    beam.fraction = static_cast<float>(random.uniform(at + 7, 0.0, 1.0));
    beam.piece = i % kPieces;
    beam.number = i;
    made->beams.push_back(beam);
  }
  return made;
}

/// A sensor that flies at 20 m/s and turns at 15 rad/s, a millisecond a piece.
std::vector<Pose> flown(std::size_t count) {
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = 1e-3 * static_cast<double>(i);
    poses.push_back({quaternion_from_rotation_vector(15.0 * t * Vector3d(0.3, -0.5, 0.8)) *
                         quaternion_from_rpy(0.1, -0.2, 3.1),
                     Vector3d(512.3, -77.1, 3.2) + 20.0 * t * Vector3d(1.0, 0.5, 0.1)});
  }
  return poses;
}

/// Where beam `i` is, in double.
Pose pose_in_double(const std::vector<Pose>& poses, const SensorBeam& beam) {
  if (poses.size() == 1) return poses[0];
  return interpolate(poses[beam.piece], poses[beam.piece + 1], static_cast<double>(beam.fraction));
}

TEST(SensorBeams, RaysAreThoseOfPosesInDouble) {
  for (const std::size_t count : {std::size_t{1}, std::size_t{kPieces + 1}}) {
    for (const bool has_origins : {false, true}) {
      const auto beams = some_beams(5000, has_origins);
      const std::vector<Pose> poses = flown(count);
      const AimedBeams aimed = aim_beams(beams, poses, 50.0f);
      std::vector<Ray> rays(beams->beams.size());
      make_rays(aimed, 0, rays);
      std::vector<Vector3f> across(rays.size());
      make_across(aimed, 0, across);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const SensorBeam& beam = beams->beams[i];
        const Pose pose = pose_in_double(poses, beam);
        const Vector3d d(beam.direction[0], beam.direction[1], beam.direction[2]);
        const Vector3d o(beam.origin[0], beam.origin[1], beam.origin[2]);
        const Vector3d a(beam.across[0], beam.across[1], 0.0);
        ASSERT_LT((rays[i].direction_world.cast<double>() - pose.rotation * d).norm(), 4e-7);
        ASSERT_LT((rays[i].origin_world - pose * o).norm(), 2e-7);
        ASSERT_LT((across[i].cast<double>() - pose.rotation * a).norm(), 4e-7);
        ASSERT_EQ(rays[i].range_max, 50.0f * beam.stretch);
      }
    }
  }
}

TEST(SensorBeams, DeviationsTurnAboutTwoAxesAcross) {
  const auto beams = some_beams(5000, false);
  const std::vector<Pose> poses = flown(1);
  AimedBeams aimed = aim_beams(beams, poses, 50.0f);
  const RandomStream random(4, StreamId::kTest, 0);
  for (std::uint64_t i = 0; i < beams->beams.size(); ++i) {
    // a tenth of them as far as any sensor's
    const double sigma = i % 10 == 0 ? 0.05 : 1e-3;
    aimed.deviations.push_back({static_cast<float>(sigma * random.normal(2 * i)),
                                static_cast<float>(sigma * random.normal(2 * i + 1))});
  }
  std::vector<Ray> rays(beams->beams.size());
  make_rays(aimed, 0, rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const SensorBeam& beam = beams->beams[i];
    const Vector3d d(beam.direction[0], beam.direction[1], beam.direction[2]);
    const Vector3d a(beam.across[0], beam.across[1], 0.0);
    const BeamDeviation by = aimed.deviations[i];
    const Vector3d turned =
        (d + static_cast<double>(by.u) * a + static_cast<double>(by.v) * d.cross(a)).normalized();
    ASSERT_LT((rays[i].direction_world.cast<double>() - poses[0].rotation * turned).norm(), 4e-7);
  }
}

TEST(SensorBeams, TheSameBitsWithEveryInstructionSetAndHoweverManyAtATime) {
  const auto beams = some_beams(1003, true);
  AimedBeams aimed = aim_beams(beams, flown(kPieces + 1), 50.0f);
  aimed.deviations.assign(beams->beams.size(), {0.001f, -0.002f});
  std::vector<Ray> expected;
  for (const std::string& kernel : kernel_names()) {
    use_kernel(kernel);
    std::vector<Ray> rays(beams->beams.size());
    make_rays(aimed, 0, rays);
    if (expected.empty()) expected = rays;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      Ray alone;
      make_rays(aimed, i, {&alone, 1});
      for (const Ray& ray : {rays[i], alone}) {
        ASSERT_EQ(ray.origin_world, expected[i].origin_world) << kernel << ' ' << i;
        ASSERT_EQ(ray.direction_world, expected[i].direction_world) << kernel << ' ' << i;
      }
    }
  }
  use_kernel("");
}

TEST(SensorBeams, AHundredDegreesWithinAPieceStillAreUnitVectors) {
  const auto beams = some_beams(2000, true);
  std::vector<Pose> poses(kPieces + 1);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    poses[i].rotation = quaternion_from_rpy(0.0, 0.0, 1.7 * static_cast<double>(i));
  }
  const AimedBeams aimed = aim_beams(beams, poses, 50.0f);
  std::vector<Ray> rays(beams->beams.size());
  make_rays(aimed, 0, rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_NEAR(rays[i].direction_world.norm(), 1.0f, 1e-6f);
    const SensorBeam& beam = beams->beams[i];
    const Vector3d o(beam.origin[0], beam.origin[1], beam.origin[2]);
    ASSERT_NEAR(rays[i].origin_world.norm(), o.norm(), 1e-6);
  }
}

TEST(SensorBeams, RefuseAnotherNumberOfPoses) {
  const auto beams = some_beams(10, false);
  EXPECT_THROW(static_cast<void>(aim_beams(beams, {}, 50.0f)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(aim_beams(beams, flown(kPieces), 50.0f)), std::invalid_argument);
}

TEST(SensorBeams, AllRenderersTakeThem) {
  ShapeScene scene;
  scene.add_rectangle({4, -5, -5}, {0, 10, 0}, {0, 0, 10});
  const auto map = testing::map_of(scene, 0.1, 20.0, 0.0);
  const auto beams = some_beams(3000, true);
  const AimedBeams aimed = aim_beams(beams, std::vector<Pose>{Pose{}}, 30.0f);
  std::vector<Ray> rays(beams->beams.size());
  make_rays(aimed, 0, rays);
  for (const char* name : {"beam", "paper"}) {
    SCOPED_TRACE(name);
    const auto renderer = make_renderer(name, Scene{map});
    RayBatch by_rays;
    by_rays.rays = rays;
    RayBatch by_beams;
    by_beams.aimed = &aimed;
    std::vector<Hit> a(rays.size());
    std::vector<Hit> b(rays.size());
    renderer->render(by_rays, a, Executor(1));
    renderer->render(by_beams, b, Executor(2));
    std::vector<float> ranges(rays.size(), -3.0f);
    RenderJob job;
    job.batch = by_beams;
    job.ranges = ranges;
    renderer->render({&job, 1}, Executor(2));
    std::size_t hits = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ASSERT_EQ(b[i].range, ranges[i]);
      ASSERT_EQ(a[i].is_return(), b[i].is_return());
      ASSERT_NEAR(a[i].range, b[i].range, 1e-4f);
      hits += a[i].is_return() ? 1 : 0;
    }
    EXPECT_GT(hits, rays.size() / 20);
    job.hits = b;
    EXPECT_THROW(renderer->render({&job, 1}, Executor(1)), std::invalid_argument);
    job.hits = {};
    job.batch.rays = rays;
    EXPECT_THROW(renderer->render({&job, 1}, Executor(1)), std::invalid_argument);
  }
}

}  // namespace
}  // namespace pointflight
