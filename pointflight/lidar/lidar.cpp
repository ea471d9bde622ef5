#include "pointflight/lidar/lidar.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kChunk = 2048;         // beams
constexpr std::uint32_t kPhases = 1u << 20;  // scans: a day of 10 Hz

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

/// Range (of a depth camera: depth) with the sensor's Gaussian noise, where returns are not
/// modelled.
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

/// By the true range: noise takes no point into a wall. False returns have none.
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
      const float range = point.label == kFalseReturn ? point.range : hits[point.beam].range;
      point.is_unknown = !known.is_seen_through(
          ray.origin_world, ray.direction_world.cast<double>(), static_cast<double>(range));
    }
  });
}

}  // namespace

Lidar::Lidar(const LidarSettings& settings,
             std::uint32_t sensor,
             std::shared_ptr<const ScanBeams> beams,
             const std::optional<Surroundings>& surroundings)
    : settings_(settings),
      sensor_(sensor),
      beams_(beams ? std::move(beams) : std::make_shared<const ScanBeams>(settings)),
      measures_depth_(settings.pattern == ScanPattern::kGrid &&
                      settings.grid.projection == GridProjection::kPinhole) {
  if (surroundings) returns_.emplace(settings, *surroundings);
}

/// What a beam's range times this is what the sensor measures and its limits are of: depth along
/// the axis for cameras, else the range itself.
float Lidar::depth_share(const Beam& beam) const {
  return measures_depth_ ? beam.direction_sensor.x() : 1.0f;
}

/// How far beams are followed: a range, of a camera a depth.
double Lidar::range_limit() const {
  return returns_ ? returns_->reach() : settings_.range_max;
}

double Lidar::reach() const {
  if (!measures_depth_) return range_limit();
  // of the pixel that lies farthest from the principal point
  const GridSettings& g = settings_.grid;
  const auto farthest = [](double center, std::int64_t count, double focal_length) {
    return std::max(std::abs(center), std::abs(static_cast<double>(count - 1) - center)) /
           focal_length;
  };
  const double u = farthest(g.cx, g.columns, g.fx);
  const double v = farthest(g.cy, g.rows, g.fy);
  return 1.001 * range_limit() * std::sqrt(1.0 + u * u + v * v);
}

std::uint64_t Lidar::pattern_scan(std::uint64_t index, std::uint64_t seed) const {
  if (!returns_) return index;
  const RandomStream random(seed, StreamId::kPatternPhase, 0);
  return index + random.bits(0)[0] % kPhases;
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
  const auto range_max = static_cast<float>(range_limit());
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

/// Turns each ray by the noise of its direction. The sensor knows nothing of it: points lie where
/// the beams should have gone.
void Lidar::shake(const ScanRequest& request, std::span<Ray> rays, const Executor& executor) const {
  const double sigma = settings_.optics.angle_sigma_deg * kDegree;
  if (sigma <= 0.0) return;
  const RandomStream random(request.seed, StreamId::kLidarAngle, sensor_);
  executor.parallel_for(rays.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto [u, v] = random.normal2(request.index << 32 | i);
      const Vector3d d = rays[i].direction_world.cast<double>();
      // any two axes across will do: the noise has none
      const Vector3d across =
          (std::abs(d.z()) < 0.9 ? d.cross(Vector3d::UnitZ()) : d.cross(Vector3d::UnitX()))
              .normalized();
      rays[i].direction_world =
          (d + sigma * (u * across + v * d.cross(across))).normalized().cast<float>();
    }
  });
}

/// What the sensor reports of each beam; a negative range where it reports nothing.
std::vector<Return> Lidar::returns_of(const ScanRequest& request,
                                      std::span<const Beam> beams,
                                      std::span<const Hit> hits,
                                      const Executor& executor) const {
  if (!returns_) return noisy_ranges(request, beams, hits, executor);
  std::vector<Return> returns(beams.size());
  const RandomStream noise(request.seed, StreamId::kLidarRangeNoise, sensor_);
  const RandomStream detection(request.seed, StreamId::kLidarDetection, sensor_);
  const RandomStream weather(request.seed, StreamId::kLidarWeather, sensor_);
  executor.parallel_for(beams.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    BeamNormals normals(noise, request.index);
    for (std::size_t i = begin; i < end; ++i) {
      const float share = depth_share(beams[i]);
      const auto [detected, place] = detection.uniform2(request.index << 32 | i);
      Hit hit = hits[i];
      if (hit.is_return()) hit.range *= share;
      BeamChance chance{request.noise ? normals(i) : 0.0, detected, place};
      if (returns_->has_weather()) {
        const auto [drop, drop_place] = weather.uniform2(request.index << 32 | i);
        chance.drop = drop;
        chance.drop_place = drop_place;
      }
      returns[i] = returns_->measure(hit, chance);
      returns[i].range /= share;
    }
  });
  return returns;
}

/// The same where returns are not modelled.
std::vector<Return> Lidar::noisy_ranges(const ScanRequest& request,
                                        std::span<const Beam> beams,
                                        std::span<const Hit> hits,
                                        const Executor& executor) const {
  std::vector<Return> returns(beams.size());
  const RandomStream random(request.seed, StreamId::kLidarRangeNoise, sensor_);
  const auto range_min = static_cast<float>(settings_.range_min);
  executor.parallel_for(beams.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    BeamNormals normals(random, request.index);
    for (std::size_t i = begin; i < end; ++i) {
      if (!hits[i].is_return()) continue;
      const float share = depth_share(beams[i]);
      float range = hits[i].range;
      if (request.noise) range = measured(range * share, settings_.noise, normals, i) / share;
      // noise neither makes nor ends a return at the far limit; it may at the near one
      if (range * share < range_min) continue;
      returns[i] = {range, hits[i].intensity};
    }
  });
  return returns;
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
  const auto ordered = beams_->of(pattern_scan(request.index, request.seed), executor);
  const std::vector<Beam>& beams = ordered->beams;
  scan.beams = beams.size();

  const Pose middle = T_world_sensor.at(request.start + period() / 2);
  const bool snapshot = request.snapshot || renderer.is_snapshot();
  scan.snapshot = snapshot;
  scan.middle = middle_of(request.start, beams, snapshot);
  std::vector<Duration> offsets(request.bodies.empty() || snapshot ? 0 : beams.size());
  std::vector<Ray> rays =
      rays_of(beams, request.start, T_world_sensor, snapshot, offsets, executor);
  if (returns_ && request.noise) shake(request, rays, executor);

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

  const std::vector<Return> returns = returns_of(request, beams, hits, executor);
  scan.points.reserve(beams.size());
  for (std::size_t i = 0; i < beams.size(); ++i) {
    const float range = returns[i].range;
    if (range < 0.0f) continue;
    scan.points.push_back({beams[i].origin_sensor + range * beams[i].direction_sensor,
                           range,
                           returns[i].intensity,
                           beams[i].time_offset,
                           beams[i].ring,
                           static_cast<std::uint32_t>(i),
                           returns[i].is_false ? kFalseReturn : hits[i].label});
  }
  if (request.known != nullptr) mark_unknown(*request.known, rays, hits, scan, executor);
  return scan;
}

}  // namespace pointflight
