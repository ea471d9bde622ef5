#include "pointflight/gpu/internal/kernel_choice.hpp"

#include <algorithm>
#include <map>
#include <mutex>
#include <numeric>
#include <utility>

#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/gpu/internal/device_batch.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"

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

TrialAims trial_aims(std::size_t beams, std::size_t aims) {
  constexpr std::uint32_t kPieces = 5;
  const RandomStream random(2, StreamId::kTest, 0);
  auto made = std::make_shared<SensorBeams>();
  made->pieces = kPieces;
  made->has_origins = true;
  for (std::uint32_t i = 0; i < beams; ++i) {
    const std::uint64_t at = std::uint64_t{7} * i;
    const Vector3f d = (Vector3d(random.normal(at), random.normal(at + 1), random.normal(at + 2)) +
                        Vector3d(0.01, 0.0, 0.0))
                           .normalized()
                           .cast<float>();
    const Vector3f across = horizontal_across(d);
    made->beams.push_back({{d.x(), d.y(), d.z()},
                           {static_cast<float>(random.uniform(at + 3, -0.1, 0.1)),
                            static_cast<float>(random.uniform(at + 4, -0.1, 0.1)),
                            static_cast<float>(random.uniform(at + 5, -0.1, 0.1))},
                           {across.x(), across.y()},
                           1.0f + 0.25f * static_cast<float>(i % 2),
                           static_cast<float>(random.uniform(at + 6, 0.0, 1.0)),
                           i % kPieces,
                           i});
    // another order than that of the numbers
    made->order.push_back(static_cast<std::uint32_t>(beams) - 1 - i);
  }
  TrialAims trial{made, {}};
  for (std::uint64_t k = 0; k < aims; ++k) {
    const std::uint64_t at = std::uint64_t{1} << 32 | 8 * k;
    const Vector3d from(random.uniform(at, 1.0, 7.0),
                        random.uniform(at + 1, 1.0, 5.0),
                        random.uniform(at + 2, 0.5, 2.5));
    const Vector3d turn(random.normal(at + 3), random.normal(at + 4), random.normal(at + 5));
    std::vector<Pose> poses;
    for (std::uint32_t p = 0; p <= (k % 2 == 0 ? kPieces : 0u); ++p) {
      poses.push_back({quaternion_from_rotation_vector((1.0 + 0.1 * p) * turn),
                       from + 0.05 * static_cast<double>(p) * turn.normalized()});
    }
    trial.aims.push_back(aim_beams(made, poses, 10.0f));
    if (k % 4 < 2) continue;
    for (std::uint64_t i = 0; i < beams; ++i) {
      const std::uint64_t draw = (k + 2) << 32 | 2 * i;
      trial.aims.back().deviations.push_back({static_cast<float>(0.004 * random.normal(draw)),
                                              static_cast<float>(0.004 * random.normal(draw + 1))});
    }
  }
  return trial;
}

namespace {

/// How many rays have the same bits by both.
std::size_t count_equal_hits(const KernelMap& map,
                             std::span<const MapRay> rays,
                             std::span<const device::DeviceHit> hits) {
  std::vector<std::uint32_t> order(rays.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<KernelHit> expected(rays.size());
  trace_beams(map, rays, order, expected);
  std::size_t equal = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const KernelHit& e = expected[i];
    const device::DeviceHit& h = hits[i];
    const bool is_same = e.range < 0.0f ? h.range == device::kNothing
                                        : h.range == e.range && h.cosine == e.cos_incidence &&
                                              h.surfel == e.strongest;
    equal += is_same || h.range == device::kTooMany ? 1 : 0;
  }
  return equal;
}

}  // namespace

namespace {

/// All surfaces alike; what comes back is reported for certain.
class TrialReceiver : public EchoReceiver {
 public:
  [[nodiscard]] double reflectivity(const Hit& hit) const override {
    return 0.3 * static_cast<double>(hit.cos_incidence);
  }
  [[nodiscard]] Reflectances reflectances() const override {
    return {.per_intensity = 0.0f, .same = 0.3f, .usual = nullptr, .least = 0.01f};
  }
  [[nodiscard]] bool is_marginal(const Echo& /*echo*/,
                                 double /*less*/,
                                 double /*more*/) const override {
    return false;
  }
  [[nodiscard]] bool takes_strongest() const override { return true; }
};

bool are_same(const Echoes& a, const Echoes& b) {
  if (a.count != b.count || a.all_hit != b.all_hit) return false;
  for (std::uint32_t i = 0; i < a.count; ++i) {
    const Echo& p = a.all[i];
    const Echo& q = b.all[i];
    if (p.range != q.range || p.reflectivity != q.reflectivity || p.depth != q.depth ||
        p.parts != q.parts || p.origin.surfel != q.origin.surfel ||
        p.origin.cos_incidence != q.origin.cos_incidence) {
      return false;
    }
  }
  return true;
}

/// How many of the trial's beams have the same echoes by both.
std::size_t count_equal_echoes(RayTracer& tracer, const TrialAims& trial) {
  const BeamRenderer beam(Scene{trial_scene()});
  const TrialReceiver receiver;
  const Executor executor(1);
  std::size_t equal = 0;
  for (const AimedBeams& aim : trial.aims) {
    std::vector<Echoes> of_device(trial.beams->beams.size());
    std::vector<Echoes> of_processor(of_device.size());
    RenderJob job;
    job.batch.aimed = &aim;
    job.batch.order = trial.beams->order;
    job.wide = WideBeams{.across = {},
                         .sigma_across = 0.002f,
                         .sigma_up = 0.001f,
                         .merge = 0.75f,
                         .sub_rays = 0,
                         .receiver = &receiver,
                         .echoes = of_processor};
    beam.render({&job, 1}, executor);
    job.wide->echoes = of_device;
    DeviceBatch batch({&job, 1}, beam, {RayTracer::kMostRays, tracer.wide_at_once()}, executor);
    for (std::size_t part = 0; part < batch.parts(); ++part) {
      batch.send(part, 0, tracer);
      tracer.wait(0);
      batch.take(part, 0, tracer);
    }
    batch.finish();
    for (std::size_t i = 0; i < of_device.size(); ++i) {
      equal += are_same(of_device[i], of_processor[i]) ? 1 : 0;
    }
  }
  return equal;
}

/// The same of rays that the device makes of beams.
std::size_t count_equal_beams(RayTracer& tracer, const KernelMap& map, const TrialAims& trial) {
  AimedPart part{trial.beams, {}, false};
  std::vector<MapRay> made;
  for (const AimedBeams& aim : trial.aims) {
    part.aims.push_back(&aim);
    RayBatch batch;
    batch.aimed = &aim;
    const std::vector<MapRay> own = map_rays(map, batch, Executor(1));
    made.insert(made.end(), own.begin(), own.end());
  }
  tracer.submit(1, map, part);
  tracer.wait(1);
  return count_equal_hits(map, made, tracer.hits(1));
}

}  // namespace

std::size_t count_equal(GpuDevice& device,
                        const DeviceMap& there,
                        const RayKernel& kernel,
                        std::size_t rays) {
  constexpr std::size_t kAims = 8;
  const KernelMap kernel_map = kernel_map_of(*trial_scene());
  RayTracer tracer(device, there, kernel);
  const std::size_t beams = rays / 4 / kAims;  // lines, and as many wide
  const std::size_t given = rays - 2 * beams * kAims;
  const std::vector<MapRay> all = map_rays(kernel_map, trial_rays(given));
  std::copy(all.begin(), all.end(), tracer.rays(0, given).begin());
  tracer.submit(0, given);
  tracer.wait(0);
  const std::size_t equal = count_equal_hits(kernel_map, all, tracer.hits(0));
  if (beams == 0) return equal;
  const TrialAims trial = trial_aims(beams, kAims);
  return equal + count_equal_beams(tracer, kernel_map, trial) + count_equal_echoes(tracer, trial);
}

std::optional<RayKernel> find_exact_kernel(GpuDevice& device) {
  const DeviceMap there(device, *trial_scene());
  for (const RayKernel& kernel : kernels_for(device)) {
    if (count_equal(device, there, kernel, kTrialRays) == kTrialRays) return kernel;
  }
  return std::nullopt;
}

std::optional<RayKernel> exact_kernel(GpuDevice& device) {
  static std::mutex mutex;
  static std::map<std::size_t, std::optional<RayKernel>> known;
  const std::lock_guard lock(mutex);
  const auto found = known.find(device.info().index);
  if (found != known.end()) return found->second;
  return known[device.info().index] = find_exact_kernel(device);
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
