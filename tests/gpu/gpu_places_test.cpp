// A million rays of real places: sensors that roll, with noise of directions, among bodies.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pointflight/gpu/gpu_renderer.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/map/map_file.hpp"
#include "tests/gpu/device.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

struct Place {
  const char* cloud;
  double resolution;
};

std::shared_ptr<const SurfelMap> imported(const std::string& cloud, double resolution) {
  ImportOptions options;
  options.resolution = resolution;
  const ImportedMap made = import_clouds({{cloud}}, options, Executor(2));
  return SurfelMap::from_bytes(map_bytes(made.tree, made.description), cloud);
}

/// A sensor's scans through the middle of a map, 4 m/s and 2 rad/s.
PoseTrack flight_through(const SurfelMap& map) {
  const Aabb& box = map.bounds_world();
  const Vector3d middle = 0.5 * (box.min + box.max);
  std::vector<TimedPose> records;
  for (int i = 0; i <= 2000; ++i) {
    const double t = 1e-3 * i;
    records.push_back(
        {SimTime{} + from_seconds(t),
         {Quaterniond(Eigen::AngleAxisd(2.0 * t, Vector3d(0.1, -0.2, 1).normalized())),
          {middle.x() + 2.0 * t - 2.0, middle.y() + 3.5 * t - 3.5, box.min.z() + 2.0 + 0.3 * t}}});
  }
  return PoseTrack(std::move(records));
}

/// A ball that flies and a cloud of points that stands.
std::vector<Body> bodies_around(const PoseTrack& track) {
  const Vector3d at = track.at(SimTime{} + from_seconds(0.2)).translation;
  std::vector<Body> bodies;
  Body ball;
  ball.label = kFirstObstacle;
  ball.shape = Solid{Sphere{0.4}};
  ball.intensity = 30.0f;
  ball.motion = StraightMotion{SimTime{}, at + Vector3d(2, 1, 0.3), Vector3d(1, -2, 0), {}};
  ball.speed_max = 2.3;
  bodies.push_back(ball);
  ShapeScene crate;
  crate.add_box({-0.4, -0.4, -0.4}, {0.4, 0.4, 0.4});
  Body cloud;
  cloud.label = kFirstObstacle + 1;
  cloud.shape = testing::map_of(crate, 0.05);
  cloud.motion = PoseTrack(Pose{Quaterniond::Identity(), at + Vector3d(-2, 0.5, 0)});
  bodies.push_back(cloud);
  return bodies;
}

bool are_same(const Hit& a, const Hit& b) {
  return a.range == b.range && a.cos_incidence == b.cos_incidence && a.intensity == b.intensity &&
         a.label == b.label && a.surfel == b.surfel;
}

LidarSettings settings_of(const std::string& sensor) {
  if (sensor != "64x16") return load_lidar(sensor);
  LidarSettings settings = load_lidar("marsim_grid");
  settings.grid.columns = 64;
  settings.grid.rows = 16;
  return settings;
}

bool are_same(const Echoes& a, const Echoes& b) {
  if (a.count != b.count || a.all_hit != b.all_hit) return false;
  for (std::uint32_t i = 0; i < a.count; ++i) {
    const Echo& p = a.all[i];
    const Echo& q = b.all[i];
    if (p.range != q.range || p.reflectivity != q.reflectivity || p.intensity != q.intensity ||
        p.label != q.label || p.parts != q.parts || p.depth != q.depth ||
        p.origin.cos_incidence != q.origin.cos_incidence || p.origin.surfel != q.origin.surfel ||
        p.origin.sub_ray != q.origin.sub_ray) {
      return false;
    }
  }
  return true;
}

TEST(GpuPlaces, Slow_WideBeamsHaveTheProcessorsEchoes) {
  SKIP_WITHOUT_DEVICE();
  const Place places[] = {{"maps/forest_tls.pcd", 0.1}, {"maps/garage.pcd", 0.1}};
  SKIP_WITHOUT(testing::shared_data(places[0].cloud));
  const Executor executor(2);
  std::size_t beams = 0;
  std::size_t echoes = 0;
  for (const Place& place : places) {
    const auto map = imported(testing::shared_data(place.cloud), place.resolution);
    const auto beam = make_renderer("beam", Scene{map});
    const auto gpu = make_gpu_renderer(Scene{map});
    const PoseTrack track = flight_through(*map);
    const std::vector<Body> bodies = bodies_around(track);
    for (const char* sensor : {"mid360", "os1_128", "avia"}) {
      SCOPED_TRACE(fmt::format("{} {}", place.cloud, sensor));
      const Lidar lidar(load_lidar(sensor), 0, nullptr, Surroundings{});
      for (std::uint64_t k = 0; k < 3; ++k) {
        ScanRequest request;
        request.index = k;
        request.start = SimTime{} + static_cast<std::int64_t>(k) * lidar.period();
        request.snapshot = k % 2 == 1;
        request.seed = 3;
        if (k < 2) request.bodies = bodies;
        const auto of_beam = lidar.aim(request, track, *beam, executor);
        const auto of_gpu = lidar.aim(request, track, *gpu, executor);
        const RenderJob a = of_beam->job();
        const RenderJob b = of_gpu->job();
        ASSERT_TRUE(a.wide && b.wide);
        beam->render({&a, 1}, executor);
        gpu->render({&b, 1}, executor);
        for (std::size_t i = 0; i < a.wide->echoes.size(); ++i) {
          ASSERT_TRUE(are_same(a.wide->echoes[i], b.wide->echoes[i])) << k << ' ' << i;
          echoes += a.wide->echoes[i].count;
        }
        beams += a.batch.size();
      }
    }
  }
  EXPECT_GT(beams, 400'000u);
  EXPECT_GT(echoes, beams / 4);
}

TEST(GpuPlaces, Slow_AMillionRaysHaveTheProcessorsBits) {
  SKIP_WITHOUT_DEVICE();
  const Place places[] = {
      {"maps/forest_tls.pcd", 0.1}, {"maps/drone_hall.pcd", 0.05}, {"maps/garage.pcd", 0.1}};
  SKIP_WITHOUT(testing::shared_data(places[0].cloud));
  const Executor executor(2);
  std::size_t rays = 0;
  std::size_t on_bodies = 0;
  for (const Place& place : places) {
    const auto map = imported(testing::shared_data(place.cloud), place.resolution);
    const auto beam = make_renderer("beam", Scene{map});
    const auto gpu = make_gpu_renderer(Scene{map});
    const PoseTrack track = flight_through(*map);
    const std::vector<Body> bodies = bodies_around(track);
    for (const char* sensor : {"mid360", "os1_128", "avia", "64x16"}) {
      SCOPED_TRACE(fmt::format("{} {}", place.cloud, sensor));
      const Lidar lidar = Lidar(settings_of(sensor), 0, nullptr, Surroundings{}).as_lines();
      for (std::uint64_t k = 0; k < 5; ++k) {
        ScanRequest request;
        request.index = k;
        request.start = SimTime{} + static_cast<std::int64_t>(k) * lidar.period();
        request.snapshot = k % 2 == 1;
        request.seed = 3;
        if (k < 3) request.bodies = bodies;
        const auto of_beam = lidar.aim(request, track, *beam, executor);
        const auto of_gpu = lidar.aim(request, track, *gpu, executor);
        const RenderJob a = of_beam->job();
        const RenderJob b = of_gpu->job();
        beam->render({&a, 1}, executor);
        gpu->render({&b, 1}, executor);
        ASSERT_EQ(a.hits.size(), b.hits.size());
        for (std::size_t i = 0; i < a.hits.size(); ++i) {
          ASSERT_TRUE(are_same(a.hits[i], b.hits[i])) << k << ' ' << i;
          on_bodies += a.hits[i].label != kMapLabel ? 1 : 0;
        }
        rays += a.hits.size();
      }
    }
  }
  EXPECT_GT(rays, 1'000'000u);
  EXPECT_GT(on_bodies, 10'000u);
  RecordProperty("rays", static_cast<int>(rays));
}

}  // namespace
}  // namespace pointflight
