#include "pointflight/gpu/internal/kernel_choice.hpp"

#include <map>
#include <mutex>
#include <numeric>
#include <utility>

#include "pointflight/core/random.hpp"
#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"
#include "pointflight/render/internal/grid_origin.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kTrialRays = std::size_t{1} << 15;
constexpr double kResolution = 0.05;     // m
constexpr double kPointsPerCell = 20.0;  // of the trial's cloud

/// Points in memory.
class PointsReader : public CloudReader {
 public:
  explicit PointsReader(const std::vector<CloudPoint>& points) : points_(points) {}
  bool read(std::vector<CloudPoint>& batch) override {
    batch.assign(std::exchange(done_, true) ? points_.end() : points_.begin(), points_.end());
    return !batch.empty();
  }
  [[nodiscard]] bool has_intensity() const override { return false; }
  [[nodiscard]] double share_read() const override { return done_ ? 1.0 : 0.0; }

 private:
  const std::vector<CloudPoint>& points_;
  bool done_ = false;
};

std::shared_ptr<const SurfelMap> imported(const ShapeScene& scene) {
  std::vector<CloudPoint> points;
  scene.sample(kPointsPerCell / (kResolution * kResolution), 0.0, 1, [&](const Vector3d& p) {
    points.push_back({p, 0.0f});
  });
  ImportOptions options;
  options.resolution = kResolution;
  options.outliers.enabled = false;
  const ImportedMap map = build_map(
      {"trial"},
      [&](std::size_t) { return std::make_unique<PointsReader>(points); },
      options,
      Executor(1));
  return SurfelMap::from_bytes(map_bytes(map.tree, map.description), "trial");
}

}  // namespace

void pack_rays(const SurfelMap& map,
               std::span<const Ray> rays,
               std::span<const std::uint32_t> order,
               std::span<device::DeviceRay> packed) {
  const Vector3d& origin = map.origin_world();
  const double r = map.resolution();
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Ray& ray = rays[order[i]];
    const GridOrigin x = grid_origin(ray.origin_world.x() - origin.x(), r);
    const GridOrigin y = grid_origin(ray.origin_world.y() - origin.y(), r);
    const GridOrigin z = grid_origin(ray.origin_world.z() - origin.z(), r);
    const Vector3f& d = ray.direction_world;
    packed[i] = {
        x.voxel, y.voxel, z.voxel, x.rest, y.rest, z.rest, d.x(), d.y(), d.z(), ray.range_max};
  }
}

std::vector<Ray> trial_rays(std::size_t count) {
  const RandomStream random(1, StreamId::kTest, 0);
  std::vector<Ray> rays;
  for (std::uint64_t i = 0; rays.size() < count; ++i) {
    Ray ray;
    ray.origin_world = {random.uniform(6 * i, 0.3, 7.7),
                        random.uniform(6 * i + 1, 0.3, 5.7),
                        random.uniform(6 * i + 2, 0.2, 2.8)};
    const Vector3d d(random.normal(6 * i + 3), random.normal(6 * i + 4), random.normal(6 * i + 5));
    if (d.norm() < 1e-3) continue;
    ray.direction_world = d.normalized().cast<float>();
    ray.range_max = 20.0f;
    rays.push_back(ray);
  }
  return rays;
}

std::size_t count_equal(GpuDevice& device, const RayKernel& kernel, std::size_t rays) {
  const auto map = trial_scene();
  const std::vector<Ray> all = trial_rays(rays);
  std::vector<std::uint32_t> order(all.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<KernelHit> expected(all.size());
  trace_beams(kernel_map_of(*map), all, order, expected);
  const DeviceMap there(device, *map);
  RayTracer tracer(device, there, kernel);
  pack_rays(*map, all, order, tracer.rays(0, all.size()));
  tracer.submit(0, all.size());
  std::size_t equal = 0;
  const std::span hits = tracer.collect(0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const KernelHit& e = expected[i];
    const device::DeviceHit& h = hits[i];
    const bool is_same = e.range < 0.0f ? h.range == device::kNothing
                                        : h.range == e.range && h.cosine == e.cos_incidence &&
                                              h.surfel == e.strongest;
    equal += is_same || h.range == device::kTooMany ? 1 : 0;
  }
  return equal;
}

std::optional<RayKernel> exact_kernel(GpuDevice& device) {
  static std::mutex mutex;
  static std::map<std::size_t, std::optional<RayKernel>> known;
  const std::lock_guard lock(mutex);
  const auto found = known.find(device.info().index);
  if (found != known.end()) return found->second;
  std::optional<RayKernel> chosen;
  for (const RayKernel& kernel : kernels_for(device)) {
    if (count_equal(device, kernel, kTrialRays) < kTrialRays) continue;
    chosen = kernel;
    break;
  }
  known[device.info().index] = chosen;
  return chosen;
}

std::shared_ptr<const SurfelMap> trial_scene() {
  static const auto map = [] {
    ShapeScene scene;
    scene.add_rectangle({0, 0, 0}, {8, 0, 0}, {0, 6, 0});
    scene.add_rectangle({0, 0, 3}, {8, 0, 0}, {0, 6, 0.4});
    scene.add_rectangle({0, 0, 0}, {8, 0, 0}, {0, 0, 3});
    scene.add_rectangle({0, 6, 0}, {8, 0, 0}, {0, 0, 3});
    scene.add_rectangle({0, 0, 0}, {0, 6, 0}, {0, 0, 3});
    scene.add_rectangle({8, 0, 0}, {0, 6, 0}, {0, 0, 3});
    for (int i = 0; i < 6; ++i) {
      const double x = 1.0 + 1.1 * i;
      scene.add_box({x, 2.0, 0}, {x + 0.3, 2.3, 3});
      scene.add_box({x, 4.0, 1.0}, {x + 0.02, 4.02, 3});
    }
    return imported(scene);
  }();
  return map;
}

}  // namespace pointflight
