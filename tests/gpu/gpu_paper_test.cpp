// The paper's images by a device beside those by the processor.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pointflight/gpu/gpu_renderer.hpp"
#include "pointflight/gpu/internal/kernel_choice.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "tests/gpu/device.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

/// What the rays of a sensor's snapshot hit.
std::vector<Hit> hits_by(const Renderer& renderer,
                         const std::string& sensor,
                         const Pose& pose,
                         std::span<const Body> bodies) {
  const Executor executor(2);
  const Lidar lidar(load_lidar(sensor), 0);
  ScanRequest request;
  request.snapshot = true;
  request.bodies = bodies;
  const auto exposure = lidar.aim(request, PoseTrack(pose), renderer, executor);
  RenderJob job = exposure->job();
  std::vector<Hit> hits(job.batch.size());
  job.hits = hits;
  job.wide.reset();
  renderer.render({&job, 1}, executor);
  return hits;
}

/// Rays that hit something by both.
std::size_t expect_equal(const std::shared_ptr<const SurfelMap>& map,
                         const std::vector<Pose>& poses,
                         std::span<const Body> bodies) {
  const auto paper = make_renderer("paper", Scene{map});
  const auto device = make_gpu_paper_renderer(Scene{map});
  std::size_t returns = 0;
  std::size_t different = 0;
  for (const char* sensor : {"mid360", "avia", "os1_128", "marsim_grid"}) {
    for (const Pose& pose : poses) {
      const std::vector<Hit> expected = hits_by(*paper, sensor, pose, bodies);
      const std::vector<Hit> hits = hits_by(*device, sensor, pose, bodies);
      for (std::size_t i = 0; i < hits.size(); ++i) {
        const Hit& a = expected[i];
        const Hit& b = hits[i];
        returns += a.is_return() ? 1 : 0;
        const bool is_same = a.range == b.range && a.cos_incidence == b.cos_incidence &&
                             a.intensity == b.intensity && a.label == b.label;
        if (!is_same && different++ < 3) {
          ADD_FAILURE() << sensor << " ray " << i << ": " << b.range << " m, " << b.cos_incidence
                        << "; processor " << a.range << ", " << a.cos_incidence;
        }
      }
    }
  }
  EXPECT_EQ(different, 0u);
  EXPECT_TRUE(take_gpu_notices().empty());
  return returns;
}

Pose looking(const Vector3d& from, double yaw, double roll) {
  return {Quaterniond(Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) *
                      Eigen::AngleAxisd(roll, Vector3d::UnitX())),
          from};
}

TEST(GpuPaper, ImagesAreThoseOfTheProcessor) {
  SKIP_WITHOUT_DEVICE();
  Body ball;
  ball.label = kFirstObstacle;
  ball.shape = Solid{Sphere{0.4}};
  ball.intensity = 50.0f;
  ball.motion = PoseTrack(Pose{Quaterniond::Identity(), {4.0, 3.2, 1.4}});
  // the last two so near to a wall that points fill thousands of pixels, and behind the sensor
  const std::vector<Pose> poses = {looking({2.0, 3.0, 1.2}, 0.3, 0.1),
                                   looking({6.0, 1.0, 2.0}, 2.9, -0.4),
                                   looking({0.09, 3.0, 1.5}, 3.1, 0.0),
                                   looking({7.95, 5.0, 2.9}, 0.2, 0.7)};
  EXPECT_GT(expect_equal(trial_scene(), poses, {&ball, 1}), 100000u);
}

TEST(GpuPaper, AForestToo) {
  SKIP_WITHOUT_DEVICE();
  ForestOptions forest;
  forest.size_x = 24.0;
  forest.size_y = 20.0;
  const auto map = testing::map_of(make_forest(forest), 0.1, 3.0, 0.01);
  EXPECT_GT(expect_equal(map, {looking({12.0, 10.0, 2.0}, 0.0, 0.0)}, {}), 10000u);
}

}  // namespace
}  // namespace pointflight
