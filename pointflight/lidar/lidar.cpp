#include "pointflight/lidar/lidar.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kChunk = 2048;  // beams

/// Standard normals for the beams of a scan. Two neighbours share a draw of two: half the price
/// where a scan's beams are asked for one after the other.
class BeamNormals {
 public:
  BeamNormals(const RandomStream& random, std::uint64_t scan) : random_(random), scan_(scan) {}
  double operator()(std::size_t beam) {
    if (beam / 2 != pair_) {
      pair_ = beam / 2;
      normals_ = random_.normal2(scan_ << 32 | pair_);
    }
    return normals_[beam % 2];
  }

 private:
  const RandomStream& random_;
  std::uint64_t scan_;
  std::uint64_t pair_ = ~std::uint64_t{0};
  std::array<double, 2> normals_{};
};

/// Range (of a depth camera: depth) with the sensor's Gaussian noise.
float measured(float range,
               const RangeNoiseSettings& noise,
               BeamNormals& normals,
               std::size_t beam) {
  const double r = static_cast<double>(range);
  const double far = noise.range_sigma_per_m2 * r * r;
  const double sigma = std::sqrt(noise.range_sigma * noise.range_sigma + far * far);
  return sigma > 0.0 ? static_cast<float>(r + sigma * normals(beam)) : range;
}

/// Written out: with Eigen's products by the quaternion, in the baseline's pairs of numbers, this
/// took 8 % of a swarm's time instead of 3 %.
Vector3d turned(const Matrix3d& m, const Vector3f& v) {
  const double x = static_cast<double>(v.x());
  const double y = static_cast<double>(v.y());
  const double z = static_cast<double>(v.z());
  return {m(0, 0) * x + m(0, 1) * y + m(0, 2) * z,
          m(1, 0) * x + m(1, 1) * y + m(1, 2) * z,
          m(2, 0) * x + m(2, 1) * y + m(2, 2) * z};
}

/// By the true range: noise takes no point into a wall.
void mark_unknown(const KnownSpace& known,
                  std::span<const Ray> rays,
                  std::span<const Hit> hits,
                  Scan& scan,
                  const Executor& executor) {
  scan.marks_unknown = true;
  executor.parallel_for(scan.points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      ScanPoint& point = scan.points[i];
      const Ray& ray = rays[point.beam];
      point.is_unknown = !known.is_seen_through(ray.origin_world,
                                                ray.direction_world.cast<double>(),
                                                static_cast<double>(hits[point.beam].range));
    }
  });
}

}  // namespace

Lidar::Lidar(const LidarSettings& settings,
             std::uint32_t sensor,
             std::shared_ptr<const ScanBeams> beams)
    : settings_(settings),
      sensor_(sensor),
      beams_(beams ? std::move(beams) : std::make_shared<const ScanBeams>(settings)),
      measures_depth_(settings.pattern == ScanPattern::kGrid &&
                      settings.grid.projection == GridProjection::kPinhole) {}

/// What a beam's range times this is what the sensor measures and its limits are of: depth along
/// the axis for cameras, else the range itself.
float Lidar::depth_share(const Beam& beam) const {
  return measures_depth_ ? beam.direction_sensor.x() : 1.0f;
}

double Lidar::reach() const {
  if (!measures_depth_) return settings_.range_max;
  // of the pixel that lies farthest from the principal point
  const GridSettings& g = settings_.grid;
  const auto farthest = [](double center, std::int64_t count, double focal_length) {
    return std::max(std::abs(center), std::abs(static_cast<double>(count - 1) - center)) /
           focal_length;
  };
  const double u = farthest(g.cx, g.columns, g.fx);
  const double v = farthest(g.cy, g.rows, g.fy);
  return 1.001 * settings_.range_max * std::sqrt(1.0 + u * u + v * v);
}

SimTime Lidar::middle_of(SimTime start, std::span<const Beam> beams, bool snapshot) const {
  if (snapshot || beams.empty()) return start + period() / 2;
  return start + (beams.front().time_offset + beams.back().time_offset) / 2;
}

Duration Lidar::period() const {
  return from_seconds(1.0 / settings_.rate);
}

/// Beams in the world, each from the pose at its own time, those of a snapshot from the one in the
/// middle. Fills `offsets` where there are as many.
std::vector<Ray> Lidar::rays_of(std::span<const Beam> beams,
                                SimTime start,
                                const PoseTrack& T_world_sensor,
                                bool snapshot,
                                std::span<Duration> offsets,
                                const Executor& executor) const {
  const Pose middle = T_world_sensor.at(start + period() / 2);
  std::vector<Ray> rays(beams.size());
  const auto range_max = static_cast<float>(settings_.range_max);
  executor.parallel_for(beams.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    Vector3d position = middle.translation;
    Matrix3d rotation = middle.rotation.toRotationMatrix();
    Duration pose_time{-1};
    for (std::size_t i = begin; i < end; ++i) {
      if (!snapshot && beams[i].time_offset != pose_time) {
        pose_time = beams[i].time_offset;
        const Pose pose = T_world_sensor.at(start + pose_time);
        position = pose.translation;
        rotation = pose.rotation.toRotationMatrix();
      }
      rays[i].origin_world = turned(rotation, beams[i].origin_sensor) + position;
      rays[i].direction_world =
          turned(rotation, beams[i].direction_sensor).cast<float>().normalized();
      rays[i].range_max = range_max / depth_share(beams[i]);
      if (!offsets.empty()) offsets[i] = beams[i].time_offset;
    }
  });
  return rays;
}

Scan Lidar::take(const ScanRequest& request,
                 const PoseTrack& T_world_sensor,
                 const Renderer& renderer,
                 const Executor& executor) const {
  Scan scan;
  scan.index = request.index;
  scan.sensor = sensor_;
  scan.start = request.start;
  scan.end = request.start + period();
  const auto ordered = beams_->of(request.index, executor);
  const std::vector<Beam>& beams = ordered->beams;
  scan.beams = beams.size();

  const Pose middle = T_world_sensor.at(request.start + period() / 2);
  const bool snapshot = request.snapshot || renderer.is_snapshot();
  scan.snapshot = snapshot;
  scan.middle = middle_of(request.start, beams, snapshot);
  std::vector<Duration> offsets(request.bodies.empty() || snapshot ? 0 : beams.size());
  const std::vector<Ray> rays =
      rays_of(beams, request.start, T_world_sensor, snapshot, offsets, executor);

  std::vector<Hit> hits(beams.size());
  RayBatch batch;
  batch.rays = rays;
  batch.order = ordered->order;
  batch.T_world_sensor = middle;
  batch.range_max = static_cast<float>(reach());
  batch.bodies = request.bodies;
  batch.snapshot_time = request.start + period() / 2;
  batch.time = snapshot ? batch.snapshot_time : request.start;
  batch.time_offsets = offsets;
  batch.image_resolution = settings_.image_resolution_deg * kDegree;
  renderer.render(batch, hits, executor);

  const RandomStream random(request.seed, StreamId::kLidarRangeNoise, sensor_);
  std::vector<float> ranges(beams.size());
  executor.parallel_for(beams.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    BeamNormals normals(random, request.index);
    for (std::size_t i = begin; i < end; ++i) {
      ranges[i] = hits[i].range;
      if (!hits[i].is_return() || !request.noise) continue;
      const float share = depth_share(beams[i]);
      ranges[i] = measured(hits[i].range * share, settings_.noise, normals, i) / share;
    }
  });
  const auto range_min = static_cast<float>(settings_.range_min);
  scan.points.reserve(beams.size());
  for (std::size_t i = 0; i < beams.size(); ++i) {
    // noise neither makes nor ends a return at the far limit; it may at the near one
    if (!hits[i].is_return() || ranges[i] * depth_share(beams[i]) < range_min) continue;
    scan.points.push_back({beams[i].origin_sensor + ranges[i] * beams[i].direction_sensor,
                           ranges[i],
                           hits[i].intensity,
                           beams[i].time_offset,
                           beams[i].ring,
                           static_cast<std::uint32_t>(i),
                           hits[i].label});
  }
  if (request.known != nullptr) mark_unknown(*request.known, rays, hits, scan, executor);
  return scan;
}

}  // namespace pointflight
