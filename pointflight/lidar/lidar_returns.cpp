// What a LiDAR makes of what its beams hit.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/lidar/internal/aimed.hpp"
#include "pointflight/lidar/internal/range_offsets.hpp"
#include "pointflight/lidar/residual_motion.hpp"
#include "pointflight/lidar/return_chances.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kReturnsPerChunk = 2048;  // beams

/// Standard normals for the beams of a scan. Two neighbours share a draw of two: half the price
/// if a scan's beams are asked for one after the other.
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

/// Range (of a depth camera: depth) with the sensor's Gaussian noise, if returns are not
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

bool is_assumed(const SurfelMap* map, std::uint32_t surfel) {
  return map != nullptr && map->is_assumed(surfel);
}

/// What a mark of a point is made of.
struct MarkedReturn {
  float true_range;
  bool is_assumed;
};

/// By the true range: noise takes no point into a wall. False alarms have none but their own.
void mark_unknown(const KnownSpace& known,
                  std::span<const Ray> rays,
                  std::span<const MarkedReturn> returns,
                  Scan& scan,
                  const Executor& executor) {
  scan.marks.unknown = true;
  executor.parallel_for(
      scan.points.size(), kReturnsPerChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          ScanPoint& point = scan.points[i];
          const Ray& ray = rays[point.beam];
          point.is_unknown = returns[i].is_assumed ||
                             !known.is_seen_through(ray.origin_world,
                                                    ray.direction_world.cast<double>(),
                                                    static_cast<double>(returns[i].true_range));
        }
      });
}

/// `Scan::truth` of its points. `returns`: those of all beams, room for `most` each.
void add_truth(std::span<const Return> returns,
               const PoseTrack& T_world_sensor,
               const SurfelMap* map,
               Scan& scan) {
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
    scan.truth.push_back(
        {made.true_range,
         is_false ? 0.0f : static_cast<float>(math::acos(cosine)),
         made.depth,
         (T_start_seen * point.position_sensor.cast<double>()).cast<float>(),
         made.origin.surfel,
         made.origin.sub_ray,
         made.parts,
         !is_false && is_assumed(map, made.origin.surfel),
         is_false || map == nullptr ? SurfelLabel{} : map->notes().label(made.origin.surfel)});
  }
}

/// What a sensor measures of a range: the range times `share`, plus `offset`.
struct Measured {
  float share;
  float offset;  ///< m
};

/// `Echoes` or `Hit` of a beam with the ranges that the sensor measures.
///@{
Echoes measured(Echoes echoes, const Measured& by) {
  for (std::size_t k = 0; k < echoes.count; ++k) {
    echoes.all[k].range = echoes.all[k].range * by.share + by.offset;
  }
  return echoes;
}
Hit measured(Hit hit, const Measured& by) {
  if (hit.is_return()) hit.range = hit.range * by.share + by.offset;
  return hit;
}
///@}

}  // namespace

RangeOffsets Lidar::offsets_of(const Aimed& aimed) const {
  const ScanRequest& request = aimed.request;
  return RangeOffsets(
      request.noise ? settings_.noise : RangeNoiseSettings{}, request.seed, sensor_, aimed.beams());
}

/// What the sensor reports of each beam, of which `seen` are the `Echoes` or `Hit`s.
template <class Seen>
Lidar::Received Lidar::reported(const Aimed& aimed,
                                std::span<const Seen> seen,
                                const Executor& executor) const {
  const std::vector<Beam>& beams = aimed.beams();
  Received received;
  received.most = most_returns(settings_.detection.returns);
  const std::size_t most = received.most;
  received.returns.resize(beams.size() * most);
  const RangeOffsets offsets = offsets_of(aimed);
  executor.parallel_for(beams.size(), kReturnsPerChunk, [&](std::size_t begin, std::size_t end) {
    const ScanRequest& request = aimed.request;
    ReturnChances chances({request.seed, sensor_, request.index}, request.noise);
    const std::size_t count = end - begin;
    const std::span<Return> made(received.returns.data() + begin * most, count * most);
    if (!measures_depth_ && offsets.empty()) {
      returns_->measure(seen.subspan(begin, count), chances.of(begin, count), made);
      return;
    }
    const auto measured_by = [&](std::size_t beam) {
      return Measured{depth_share(beams[beam]), offsets.of(beams[beam])};
    };
    std::vector<Seen> ranges;
    ranges.reserve(count);
    for (std::size_t i = begin; i < end; ++i) ranges.push_back(measured(seen[i], measured_by(i)));
    returns_->measure(std::span<const Seen>(ranges), chances.of(begin, count), made);
    for (std::size_t i = 0; i < made.size(); ++i) {
      if (!made[i].is_return()) continue;
      const Measured by = measured_by(begin + i / most);
      made[i].range /= by.share;
      if (made[i].parts > 0) made[i].true_range -= by.offset;  // false ones are of no surface
      made[i].true_range /= by.share;
    }
  });
  return received;
}

Lidar::Received Lidar::received(const Aimed& aimed,
                                std::span<const Echoes> echoes,
                                const Executor& executor) const {
  return reported(aimed, echoes, executor);
}

/// Where returns are not modelled: whatever is hit comes back, with noise.
Lidar::Received Lidar::received_as_ideal(const Aimed& aimed,
                                         std::span<const Hit> hits,
                                         const Executor& executor) const {
  const ScanRequest& request = aimed.request;
  const std::vector<Beam>& beams = aimed.beams();
  Received received;
  std::vector<Return>& returns = received.returns;
  returns.resize(beams.size());
  const RandomStream random(request.seed, StreamId::kLidarRangeNoise, sensor_);
  const auto range_min = static_cast<float>(settings_.range_min);
  const RangeOffsets offsets = offsets_of(aimed);
  executor.parallel_for(beams.size(), kReturnsPerChunk, [&](std::size_t begin, std::size_t end) {
    BeamNormals normals(random, request.index);
    for (std::size_t i = begin; i < end; ++i) {
      if (!hits[i].is_return()) continue;
      const float share = depth_share(beams[i]);
      float range = hits[i].range;
      if (request.noise) {
        const float off = range * share + offsets.of(beams[i]);
        range = with_noise(off, settings_.noise, normals, i) / share;
      }
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
  return received;
}

/// By the disparities of a stereo camera.
Lidar::Received Lidar::received_as_stereo(const Aimed& aimed,
                                          std::span<const Hit> hits,
                                          const Executor& executor) const {
  const ScanRequest& request = aimed.request;
  const std::vector<Beam>& beams = aimed.beams();
  std::vector<float> shares(beams.size());
  executor.parallel_for(beams.size(), kReturnsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) shares[i] = depth_share(beams[i]);
  });
  const RandomStream pixels(request.seed, StreamId::kLidarRangeNoise, sensor_);
  const RandomStream windows(request.seed, StreamId::kStereo, sensor_);
  Received received;
  std::vector<Return>& returns = received.returns;
  returns =
      stereo_->measure(hits, shares, {pixels, windows, request.index, request.noise}, executor);
  executor.parallel_for(returns.size(), kReturnsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      returns[i].range /= shares[i];
      returns[i].true_range /= shares[i];
    }
  });
  return received;
}

/// What a camera's imager sees by the sun and by its own light, which falls off with the square of
/// the depth; exposed so that the mean of what it hits is a third of the brightest.
std::vector<std::uint8_t> Lidar::infrared_of(std::span<const Beam> beams,
                                             std::span<const Hit> hits,
                                             const Executor& executor) const {
  constexpr double kMean = 85.0;
  std::vector<double> light(hits.size(), 0.0);
  executor.parallel_for(hits.size(), kReturnsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!hits[i].is_return()) continue;
      const auto depth = static_cast<double>(std::max(hits[i].range * depth_share(beams[i]), 0.1f));
      light[i] = returns_->reflectivity(hits[i]) *
                 (returns_->sun_klx() + settings_.grid.projector_klx / (depth * depth));
    }
  });
  double sum = 0.0;  // in the order of the pixels, whatever the threads
  double lit = 0.0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!hits[i].is_return()) continue;
    sum += light[i];
    lit += 1.0;
  }
  std::vector<std::uint8_t> infrared(hits.size(), 0);
  if (!(sum > 0.0)) return infrared;
  executor.parallel_for(hits.size(), kReturnsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      infrared[i] = static_cast<std::uint8_t>(std::min(255.0, kMean * light[i] * lit / sum + 0.5));
    }
  });
  return infrared;
}

/// Of beams that are lines.
Lidar::Received Lidar::received(const Aimed& aimed,
                                std::span<const Hit> hits,
                                const Executor& executor) const {
  if (!returns_) return received_as_ideal(aimed, hits, executor);
  Received made;
  if (stereo_) {
    made = received_as_stereo(aimed, hits, executor);
  } else {
    made = reported(aimed, hits, executor);
  }
  if (measures_depth_) made.infrared = infrared_of(aimed.beams(), hits, executor);
  return made;
}

/// Beams that do not leave the sensor's carrier bring nothing back.
void Lidar::take_out_blocked(const Aimed& aimed,
                             Received& received,
                             const Executor& executor) const {
  if (blockage_ == nullptr) return;
  const ScanRequest& request = aimed.request;
  const double level = request.noise ? blockage_level(request.seed, sensor_, request.start) : 0.5;
  const std::vector<Beam>& beams = aimed.beams();
  executor.parallel_for(beams.size(), kReturnsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (blockage_->share(beams[i].direction_sensor) <= level) continue;
      for (std::size_t k = 0; k < received.most; ++k) received.returns[i * received.most + k] = {};
    }
  });
}

/// Scans without motion are what deskewed ones would be, if deskewing were exact.
void Lidar::leave_motion(const Aimed& aimed, const PoseTrack& T_world_sensor, Scan& scan) const {
  const DeskewingSettings& left = settings_.deskewing;
  const ScanRequest& request = aimed.request;
  const bool is_still = aimed.snapshot || T_world_sensor.records().size() == 1;
  if (!request.noise || !is_still) return;
  if (left.rotation_sigma_deg <= 0.0 && left.translation_sigma <= 0.0) return;
  const ResidualMotion motion = residual_motion(left, request.seed, sensor_, request.start);
  const double duration = to_seconds(period());
  for (ScanPoint& point : scan.points) {
    const double time = to_seconds(point.time_offset) / duration;
    point.position_sensor = motion.moved(point.position_sensor, time);
  }
}

/// The returns as points.
Scan Lidar::written(const Aimed& aimed,
                    const PoseTrack& T_world_sensor,
                    Received received,
                    const Executor& executor) const {
  const ScanRequest& request = aimed.request;
  const std::vector<Beam>& beams = aimed.beams();
  Scan scan;
  scan.index = request.index;
  scan.sensor = sensor_;
  scan.start = request.start;
  scan.end = request.start + period();
  scan.beams = beams.size();
  scan.snapshot = aimed.snapshot;
  scan.middle = middle_of(request.start, beams, aimed.snapshot);
  scan.infrared = std::move(received.infrared);
  scan.marks.echoes = reports_echoes();
  scan.points.reserve(beams.size());
  std::vector<MarkedReturn> marked;
  for (std::size_t i = 0; i < received.returns.size(); ++i) {
    const Return& made = received.returns[i];
    if (!made.is_return()) continue;
    const std::size_t number = i / received.most;
    const Beam& beam = beams[number];
    scan.points.push_back({beam.origin_sensor + made.range * beam.direction_sensor,
                           made.range,
                           made.intensity,
                           beam.time_offset,
                           beam.ring,
                           static_cast<std::uint32_t>(number),
                           made.label});
    scan.points.back().echo = static_cast<std::uint8_t>(i % received.most);
    if (request.known != nullptr) {
      marked.push_back({made.true_range, is_assumed(request.map, made.origin.surfel)});
    }
  }
  if (request.truth) add_truth(received.returns, T_world_sensor, request.map, scan);
  leave_motion(aimed, T_world_sensor, scan);
  if (request.known != nullptr) {
    std::vector<Ray> rays(beams.size());
    make_rays(aimed.in_world, 0, rays);
    mark_unknown(*request.known, rays, marked, scan, executor);
  }
  return scan;
}

}  // namespace pointflight
