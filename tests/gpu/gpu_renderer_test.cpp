// The device beside the processor, by whatever Vulkan there is (in tests Mesa's, on the processor).
#include "pointflight/gpu/gpu_renderer.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pointflight/core/input_error.hpp"
#include "pointflight/gpu/gpu_list.hpp"
#include "pointflight/gpu/gpu_trial.hpp"
#include "pointflight/gpu/internal/kernel_choice.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "tests/gpu/device.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;

TEST(GpuDevices, AreFoundByIndexAndName) {
  SKIP_WITHOUT_DEVICE();
  const GpuInfo first = find_gpu("0");
  EXPECT_FALSE(first.name.empty());
  EXPECT_GT(first.largest_buffer, 1u << 20);
  EXPECT_EQ(find_gpu(first.name.substr(0, 4)).index, 0u);
  expect_contains(error_of([] { find_gpu("no such card"); }), first.name);
  expect_contains(error_of([] { find_gpu("99"); }), "0 ");
}

TEST(GpuDevices, OneWayOfDividingHasTheProcessorsBits) {
  SKIP_WITHOUT_DEVICE();
  const auto device = GpuDevice::open(find_gpu(""));
  const auto kernel = exact_kernel(*device);
  ASSERT_TRUE(kernel.has_value());
  const DeviceMap there(*device, *trial_scene());
  EXPECT_FALSE(there.is_split());
  EXPECT_EQ(count_equal(*device, there, *kernel, 100000), 100000u);
  // subgroups that stay, in parts that llvmpipe takes
  if (!device->has_ballots()) return;
  const RayKernel persistent{kernel->exact, true, 8};
  EXPECT_EQ(count_equal(*device, there, persistent, 100000), 100000u);
}

TEST(GpuDevices, MapsInSeveralBuffersHaveTheProcessorsBits) {
  SKIP_WITHOUT_DEVICE();
  const auto device = GpuDevice::open(find_gpu(""));
  const auto kernel = exact_kernel(*device);
  ASSERT_TRUE(kernel.has_value());
  const auto map = trial_scene();
  // not quite as large as the sections, and of no power of two
  for (const std::uint64_t parts : {2, 4}) {
    const std::uint64_t largest = map->words().size_bytes() / parts + 1000;
    const DeviceMap there(*device, *map, largest);
    SCOPED_TRACE(fmt::format(
        "{} buffers of nodes, {} of words", there.nodes().size(), there.words().size()));
    EXPECT_GE(there.words().size(), parts);
    EXPECT_LE(there.words().size(), kWordParts);
    EXPECT_EQ(count_equal(*device, there, *kernel, 50000), 50000u);
    const RayKernel persistent{kernel->exact, device->has_ballots(), 8};
    EXPECT_EQ(count_equal(*device, there, persistent, 50000), 50000u);
  }
  EXPECT_THROW(DeviceMap(*device, *map, 1u << 12), GpuError);
}

TEST(GpuDevices, TestSaysHowTheyFare) {
  SKIP_WITHOUT_DEVICE();
  GpuTrial trial("");
  EXPECT_FALSE(trial.exact_by().empty());
  EXPECT_EQ(trial.equal(), trial.rays());
  trial.trace_on_device();
  trial.trace_on_processor(Executor(2));
}

/// Scans by a sensor that flies through the trial's room among bodies.
std::vector<Scan> scans_by(const std::string& renderer_name,
                           const std::string& sensor,
                           bool snapshot,
                           const std::optional<Surroundings>& surroundings,
                           std::span<const Body> bodies,
                           const Executor& executor) {
  const auto renderer = make_renderer(renderer_name, Scene{trial_scene()});
  const Lidar lidar(load_lidar(sensor), 0, nullptr, surroundings);
  std::vector<Scan> scans;
  for (std::uint64_t k = 0; k < 3; ++k) {
    ScanRequest request;
    request.index = k;
    request.start = SimTime{} + static_cast<int>(k) * lidar.period();
    request.snapshot = snapshot;
    request.bodies = bodies;
    std::vector<TimedPose> poses;
    for (int i = 0; i < 5; ++i) {
      const double s = 0.1 * static_cast<double>(k) + 0.025 * i;
      poses.push_back({SimTime{} + from_seconds(s),
                       {Quaterniond(Eigen::AngleAxisd(2.0 * s, Vector3d(0.1, 0.2, 1).normalized())),
                        {3.0 + 2.0 * s, 3.0, 1.2 + s}}});
    }
    scans.push_back(lidar.take(request, PoseTrack(poses), *renderer, executor));
  }
  return scans;
}

std::vector<Body> balls() {
  std::vector<Body> all;
  for (int i = 0; i < 5; ++i) {
    Body body;
    body.label = kFirstObstacle + static_cast<Label>(i);
    body.shape = Solid{Sphere{0.3}};
    body.intensity = 50.0f;
    body.motion = PoseTrack(Pose{Quaterniond::Identity(), {1.5 + i, 1.0 + 0.7 * i, 1.3}});
    all.push_back(body);
  }
  return all;
}

void expect_same(const std::vector<Scan>& a, const std::vector<Scan>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    ASSERT_EQ(a[k].points.size(), b[k].points.size());
    EXPECT_GT(a[k].points.size(), 100u);
    for (std::size_t i = 0; i < a[k].points.size(); ++i) {
      const ScanPoint& p = a[k].points[i];
      const ScanPoint& q = b[k].points[i];
      ASSERT_EQ(p.beam, q.beam);
      ASSERT_EQ(p.position_sensor, q.position_sensor);
      ASSERT_EQ(p.intensity, q.intensity);
      ASSERT_EQ(p.label, q.label);
    }
  }
}

TEST(GpuRenderer, ScansAreThoseOfTheProcessor) {
  SKIP_WITHOUT_DEVICE();
  add_gpu_renderer();
  const Executor executor(2);
  for (const char* sensor : {"mid360", "avia", "os1_128", "marsim_grid"}) {
    for (const bool snapshot : {true, false}) {
      SCOPED_TRACE(fmt::format("{} {}", sensor, snapshot));
      const auto bodies = balls();
      expect_same(scans_by("gpu", sensor, snapshot, std::nullopt, bodies, executor),
                  scans_by("beam", sensor, snapshot, std::nullopt, bodies, executor));
    }
  }
}

TEST(GpuRenderer, RefusesJobsThatDoNotFit) {
  SKIP_WITHOUT_DEVICE();
  const auto renderer = make_gpu_renderer(Scene{trial_scene()});
  const std::vector<Ray> rays = trial_rays(10);
  std::vector<Hit> hits(9);
  RayBatch batch;
  batch.rays = rays;
  EXPECT_THROW(renderer->render(batch, hits, Executor(1)), std::invalid_argument);
  hits.resize(10);
  const std::vector<std::uint32_t> order{0, 1};
  batch.order = order;
  EXPECT_THROW(renderer->render(batch, hits, Executor(1)), std::invalid_argument);
  batch.order = {};
  renderer->render(batch, hits, Executor(1));
  for (std::size_t i = 0; i < rays.size(); ++i) {
    EXPECT_EQ(hits[i].range, renderer->trace(rays[i]).range);
  }
}

TEST(GpuRenderer, WideBeamsAreThoseOfTheProcessor) {
  SKIP_WITHOUT_DEVICE();
  add_gpu_renderer();
  const Executor executor(2);
  const auto bodies = balls();
  expect_same(scans_by("gpu", "mid360", false, Surroundings{}, bodies, executor),
              scans_by("beam", "mid360", false, Surroundings{}, bodies, executor));
}

}  // namespace
}  // namespace pointflight
