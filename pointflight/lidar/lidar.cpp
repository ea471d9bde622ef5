#include "pointflight/lidar/lidar.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
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
float with_noise(float range,
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

/// By the true range: noise takes no point into a wall. False alarms have none but their own.
void mark_unknown(const KnownSpace& known,
                  std::span<const Ray> rays,
                  std::span<const float> true_ranges,
                  Scan& scan,
                  const Executor& executor) {
  scan.marks.unknown = true;
  executor.parallel_for(scan.points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      ScanPoint& point = scan.points[i];
      const Ray& ray = rays[point.beam];
      point.is_unknown = !known.is_seen_through(ray.origin_world,
                                                ray.direction_world.cast<double>(),
                                                static_cast<double>(true_ranges[i]));
    }
  });
}

/// `Scan::truth` of its points. `returns`: those of all beams, `most` places each.
void tell_truth(std::span<const Return> returns, const PoseTrack& T_world_sensor, Scan& scan) {
  scan.marks.truth = true;
  scan.truth.reserve(scan.points.size());
  const Pose T_start_world = T_world_sensor.at(scan.start).inverse();
  std::size_t next = 0;
  SimTime time = scan.start;
  Pose T_start_seen;
  for (const Return& made : returns) {
    if (!made.is_return()) continue;
    const ScanPoint& point = scan.points[next++];
    if (scan.seen_at(point) != time) {
      time = scan.seen_at(point);
      T_start_seen = T_start_world * T_world_sensor.at(time);
    }
    const double cosine = std::clamp(static_cast<double>(made.origin.cos_incidence), 0.0, 1.0);
    const bool is_false = made.parts == 0;
    scan.truth.push_back({made.true_range,
                          is_false ? 0.0f : static_cast<float>(math::acos(cosine)),
                          made.depth,
                          (T_start_seen * point.position_sensor.cast<double>()).cast<float>(),
                          made.origin.surfel,
                          made.origin.sub_ray,
                          made.parts});
  }
}

/// The horizontal of the sensor across a beam; straight up or down, its y axis.
Vector3f across(const Vector3f& direction_sensor) {
  const float level = std::hypot(direction_sensor.x(), direction_sensor.y());
  if (level < 1e-6f) return Vector3f::UnitY();
  return {-direction_sensor.y() / level, direction_sensor.x() / level, 0.0f};
}

}  // namespace

Lidar::Lidar(const LidarSettings& settings,
             std::uint32_t sensor,
             std::shared_ptr<const ScanBeams> beams,
             const std::optional<Surroundings>& surroundings)
    : settings_(settings),
      sensor_(sensor),
      beams_(beams ? std::move(beams) : std::make_shared<const ScanBeams>(settings)),
      footprint_(settings.optics),
      measures_depth_(settings.pattern == ScanPattern::kGrid &&
                      settings.grid.projection == GridProjection::kPinhole) {
  if (!surroundings) return;
  returns_.emplace(settings, *surroundings);
  if (measures_depth_ && settings.grid.stereo.baseline > 0.0) stereo_.emplace(settings);
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

bool Lidar::reports_echoes() const {
  return returns_ && !footprint_.is_line() && most_returns(settings_.detection.returns) > 1;
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

/// Each beam from the pose at its own time, those of a snapshot from the one in the middle.
Lidar::WorldBeams Lidar::in_world(std::span<const Beam> beams,
                                  const ScanRequest& request,
                                  const PoseTrack& T_world_sensor,
                                  bool snapshot,
                                  const Executor& executor) const {
  const Pose middle = T_world_sensor.at(request.start + period() / 2);
  WorldBeams world;
  world.rays.resize(beams.size());
  world.offsets.resize(request.bodies.empty() || snapshot ? 0 : beams.size());
  world.across.resize(returns_ && !footprint_.is_line() ? beams.size() : 0);
  const auto range_max = static_cast<float>(range_limit());
  executor.parallel_for(beams.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    Vector3d position = middle.translation;
    Matrix3d rotation = middle.rotation.toRotationMatrix();
    Duration pose_time{-1};
    for (std::size_t i = begin; i < end; ++i) {
      if (!snapshot && beams[i].time_offset != pose_time) {
        pose_time = beams[i].time_offset;
        const Pose pose = T_world_sensor.at(request.start + pose_time);
        position = pose.translation;
        rotation = pose.rotation.toRotationMatrix();
      }
      Ray& ray = world.rays[i];
      ray.origin_world = turned(rotation, beams[i].origin_sensor) + position;
      ray.direction_world = turned(rotation, beams[i].direction_sensor).cast<float>().normalized();
      ray.range_max = range_max / depth_share(beams[i]);
      if (!world.offsets.empty()) world.offsets[i] = beams[i].time_offset;
      if (!world.across.empty()) {
        world.across[i] = turned(rotation, across(beams[i].direction_sensor)).cast<float>();
      }
    }
  });
  return world;
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

/// What the sensor reports of each beam, `most_returns` places each; a negative range where it
/// reports nothing.
std::vector<Return> Lidar::returns_of(const ScanRequest& request,
                                      std::span<const Beam> beams,
                                      std::span<const Echoes> echoes,
                                      const Executor& executor) const {
  const std::size_t most = most_returns(settings_.detection.returns);
  std::vector<Return> returns(beams.size() * most);
  const RandomStream noise(request.seed, StreamId::kLidarRangeNoise, sensor_);
  const RandomStream detection(request.seed, StreamId::kLidarDetection, sensor_);
  const RandomStream weather(request.seed, StreamId::kLidarWeather, sensor_);
  executor.parallel_for(beams.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    BeamNormals normals(noise, request.index);
    std::size_t i = begin;
    const ChanceOf chance_of = [&](std::size_t echo) {
      BeamChance chance;
      const std::uint64_t address = request.index << 32 | i;
      if (echo == 0) {
        const auto [detected, place] = detection.uniform2(address);
        return BeamChance{request.noise ? normals(i) : 0.0, detected, place};
      }
      const RandomStream own(
          request.seed, StreamId::kLidarEcho, static_cast<std::uint32_t>(echo) << 28 | sensor_);
      chance.normal = request.noise ? own.normal(2 * address) : 0.0;
      chance.detection = own.uniform(2 * address + 1);
      if (echo == Echoes::kMost) {
        const auto [drop, drop_place] = weather.uniform2(address);
        chance.drop = drop;
        chance.drop_place = drop_place;
      }
      return chance;
    };
    for (; i < end; ++i) {
      const float share = depth_share(beams[i]);
      Echoes seen = echoes[i];
      for (std::size_t k = 0; k < seen.count; ++k) seen.all[k].range *= share;
      const std::span<Return> made(returns.data() + i * most, most);
      const std::size_t count = returns_->measure(seen.span(), chance_of, made);
      for (std::size_t k = 0; k < count; ++k) {
        made[k].range /= share;
        made[k].true_range /= share;
      }
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
      if (request.noise) range = with_noise(range * share, settings_.noise, normals, i) / share;
      // noise neither makes nor ends a return at the far limit; it may at the near one
      if (range * share < range_min) continue;
      returns[i] = {.range = range,
                    .intensity = hits[i].intensity,
                    .label = hits[i].label,
                    .true_range = hits[i].range,
                    .origin = {hits[i].cos_incidence, hits[i].surfel},
                    .parts = 1};
    }
  });
  return returns;
}

/// The same of a stereo camera.
std::vector<Return> Lidar::depths_of(const ScanRequest& request,
                                     std::span<const Beam> beams,
                                     std::span<const Hit> hits,
                                     const Executor& executor) const {
  std::vector<float> shares(beams.size());
  for (std::size_t i = 0; i < beams.size(); ++i) shares[i] = depth_share(beams[i]);
  const RandomStream pixels(request.seed, StreamId::kLidarRangeNoise, sensor_);
  const RandomStream windows(request.seed, StreamId::kStereo, sensor_);
  std::vector<Return> returns =
      stereo_->measure(hits, shares, {pixels, windows, request.index, request.noise}, executor);
  for (std::size_t i = 0; i < returns.size(); ++i) {
    returns[i].range /= shares[i];
    returns[i].true_range /= shares[i];
  }
  return returns;
}

/// What a camera's imager sees by the sun and by its own light, which falls off with the square of
/// the depth; exposed so that the mean of what it meets is a third of the brightest.
std::vector<std::uint8_t> Lidar::infrared_of(std::span<const Beam> beams,
                                             std::span<const Hit> hits) const {
  constexpr double kMean = 85.0;
  std::vector<double> light(hits.size(), 0.0);
  double sum = 0.0;
  double lit = 0.0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!hits[i].is_return()) continue;
    const auto depth = static_cast<double>(std::max(hits[i].range * depth_share(beams[i]), 0.1f));
    light[i] = returns_->reflectivity(hits[i]) *
               (returns_->sun_klx() + settings_.grid.projector_klx / (depth * depth));
    sum += light[i];
    lit += 1.0;
  }
  std::vector<std::uint8_t> infrared(hits.size(), 0);
  if (!(sum > 0.0)) return infrared;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    infrared[i] = static_cast<std::uint8_t>(std::min(255.0, kMean * light[i] * lit / sum + 0.5));
  }
  return infrared;
}

/// Renders the beams and measures what comes back.
Lidar::Measured Lidar::measured(const ScanRequest& request,
                                std::span<const Beam> beams,
                                const WorldBeams& world,
                                const RayBatch& batch,
                                const Renderer& renderer,
                                const Executor& executor) const {
  std::vector<Echoes> echoes(returns_ ? beams.size() : 0);
  // what a renderer of images sees has no parts
  if (returns_ && !footprint_.is_line() && !renderer.is_snapshot()) {
    footprint_.trace({batch, world.across}, renderer, *returns_, echoes, executor);
    return {returns_of(request, beams, echoes, executor), {}};
  }
  std::vector<Hit> hits(beams.size());
  renderer.render(batch, hits, executor);
  if (!returns_) return {noisy_ranges(request, beams, hits, executor), {}};
  Measured made;
  if (measures_depth_) made.infrared = infrared_of(beams, hits);
  if (stereo_) {
    made.returns = depths_of(request, beams, hits, executor);
    return made;
  }
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!hits[i].is_return()) continue;
    echoes[i].all[0] = returns_->echo_of(hits[i]);
    echoes[i].count = 1;
  }
  made.returns = returns_of(request, beams, echoes, executor);
  return made;
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
  WorldBeams world = in_world(beams, request, T_world_sensor, snapshot, executor);
  if (returns_ && request.noise) shake(request, world.rays, executor);

  RayBatch batch;
  batch.rays = world.rays;
  batch.order = ordered->order;
  batch.T_world_sensor = middle;
  batch.range_max = static_cast<float>(reach());
  batch.bodies = request.bodies;
  batch.snapshot_time = request.start + period() / 2;
  batch.time = snapshot ? batch.snapshot_time : request.start;
  batch.time_offsets = world.offsets;
  batch.image_resolution = settings_.image_resolution_deg * kDegree;
  Measured made_of_beams = measured(request, beams, world, batch, renderer, executor);
  const std::vector<Return>& returns = made_of_beams.returns;
  scan.infrared = std::move(made_of_beams.infrared);

  scan.marks.echoes = reports_echoes();
  scan.points.reserve(beams.size());
  std::vector<float> true_ranges;
  const std::size_t most = beams.empty() ? 1 : returns.size() / beams.size();
  for (std::size_t i = 0; i < returns.size(); ++i) {
    const Return& made = returns[i];
    if (!made.is_return()) continue;
    const Beam& beam = beams[i / most];
    scan.points.push_back({beam.origin_sensor + made.range * beam.direction_sensor,
                           made.range,
                           made.intensity,
                           beam.time_offset,
                           beam.ring,
                           static_cast<std::uint32_t>(i / most),
                           made.label});
    scan.points.back().echo = static_cast<std::uint8_t>(i % most);
    if (request.known != nullptr) true_ranges.push_back(made.true_range);
  }
  if (request.truth) tell_truth(returns, T_world_sensor, scan);
  if (request.known != nullptr) {
    mark_unknown(*request.known, world.rays, true_ranges, scan, executor);
  }
  return scan;
}

}  // namespace pointflight
