#include "pointflight/lidar/lidar.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/lidar/internal/aimed.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kChunk = 2048;         // beams
constexpr std::uint32_t kPhases = 1u << 20;  // scans: a day of 10 Hz

}  // namespace

Lidar::Lidar(const LidarSettings& settings,
             std::uint32_t sensor,
             std::shared_ptr<const ScanBeams> beams,
             const std::optional<Surroundings>& surroundings)
    : settings_(settings),
      sensor_(sensor),
      beams_(beams ? std::move(beams) : std::make_shared<const ScanBeams>(settings)),
      footprint_(settings.optics),
      measures_depth_(settings.measures_depth()) {
  if (!settings.blocked.empty()) {
    blockage_ = std::make_shared<const Blockage>(read_blocked_sectors(settings));
  }
  if (!surroundings) return;
  returns_.emplace(settings, *surroundings);
  if (measures_depth_ && settings.grid.stereo.baseline > 0.0) stereo_.emplace(settings);
}

Lidar Lidar::as_lines() const {
  Lidar lines = *this;
  lines.settings_.optics.sub_rays = 1;
  lines.footprint_ = Footprint(lines.settings_.optics);
  return lines;
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

/// Where the sensor is while beams fire: at both ends of each piece of the scan, for a snapshot in
/// its middle.
std::vector<Pose> Lidar::poses_of(const PoseTrack& T_world_sensor, const Aimed& aimed) const {
  if (aimed.snapshot) return {aimed.middle};
  const auto pieces = static_cast<std::int64_t>(aimed.ordered->in_sensor->pieces);
  std::vector<Pose> poses;
  poses.reserve(static_cast<std::size_t>(pieces) + 1);
  for (std::int64_t k = 0; k <= pieces; ++k) {
    poses.push_back(T_world_sensor.at(aimed.request.start + period() * k / pieces));
  }
  return poses;
}

/// By how much each beam is turned. The sensor knows nothing of it: points lie where the beams
/// should have gone.
std::vector<BeamDeviation> Lidar::direction_noise(const ScanRequest& request,
                                                  std::size_t beams,
                                                  const Executor& executor) const {
  const double sigma = settings_.optics.angle_sigma_deg * kDegree;
  if (sigma <= 0.0) return {};
  std::vector<BeamDeviation> noise(beams);
  const RandomStream random(request.seed, StreamId::kLidarAngle, sensor_);
  executor.parallel_for(beams, kChunk, [&](std::size_t begin, std::size_t end) {
    // NOLINTBEGIN(cppcoreguidelines-pro-type-member-init): written on the next lines
    std::array<double, kChunk> us;
    std::array<double, kChunk> vs;
    // NOLINTEND(cppcoreguidelines-pro-type-member-init)
    random.normal2(request.index << 32 | begin,
                   std::span(us).first(end - begin),
                   std::span(vs).first(end - begin));
    for (std::size_t i = begin; i < end; ++i) {
      noise[i] = {static_cast<float>(sigma * us[i - begin]),
                  static_cast<float>(sigma * vs[i - begin])};
    }
  });
  return noise;
}

RayBatch Lidar::batch_of(const Aimed& aimed) const {
  const SimTime middle = aimed.request.start + period() / 2;
  RayBatch batch;
  batch.aimed = &aimed.in_world;
  batch.order = aimed.ordered->order;
  batch.T_world_sensor = aimed.middle;
  batch.range_max = static_cast<float>(reach());
  batch.bodies = aimed.request.bodies;
  batch.snapshot_time = middle;
  batch.time = aimed.snapshot ? middle : aimed.request.start;
  batch.time_offsets = aimed.offsets;
  batch.image_resolution = settings_.image_resolution_deg * kDegree;
  batch.draws = {aimed.request.seed, sensor_, aimed.request.index};
  return batch;
}

/// A scan under way.
class Lidar::OneScan : public Exposure {
 public:
  OneScan(const Lidar& lidar, Aimed aimed, const PoseTrack& T_world_sensor, bool is_wide)
      : lidar_(lidar),
        aimed_(std::move(aimed)),
        T_world_sensor_(T_world_sensor),
        is_wide_(is_wide),
        hits_(is_wide ? 0 : aimed_.beams().size()),
        echoes_(is_wide ? aimed_.beams().size() : 0) {}
  OneScan(const OneScan&) = delete;  // the job refers to the beams
  OneScan& operator=(const OneScan&) = delete;

  RenderJob job() override {
    RenderJob job{lidar_.batch_of(aimed_), hits_, std::nullopt};
    if (is_wide_) job.wide = lidar_.footprint_.beams({}, *lidar_.returns_, echoes_);
    return job;
  }

  Scan finish(const Executor& executor) override {
    Received received = is_wide_
                            ? lidar_.received(aimed_, std::span<const Echoes>(echoes_), executor)
                            : lidar_.received(aimed_, std::span<const Hit>(hits_), executor);
    lidar_.take_out_blocked(aimed_, received, executor);
    return lidar_.written(aimed_, T_world_sensor_, std::move(received), executor);
  }

 private:
  const Lidar& lidar_;
  Aimed aimed_;
  PoseTrack T_world_sensor_;
  bool is_wide_;
  std::vector<Hit> hits_;
  std::vector<Echoes> echoes_;
};

std::unique_ptr<Exposure> Lidar::aim(const ScanRequest& request,
                                     const PoseTrack& T_world_sensor,
                                     const Renderer& renderer,
                                     const Executor& executor) const {
  Aimed aimed;
  aimed.request = request;
  aimed.ordered = beams_->of(pattern_scan(request.index, request.seed), executor);
  aimed.snapshot = request.snapshot || renderer.is_snapshot();
  aimed.middle = T_world_sensor.at(request.start + period() / 2);
  aimed.in_world = aim_beams(
      aimed.ordered->in_sensor, poses_of(T_world_sensor, aimed), static_cast<float>(range_limit()));
  if (returns_ && request.noise) {
    aimed.in_world.deviations = direction_noise(request, aimed.beams().size(), executor);
  }
  if (!request.bodies.empty() && !aimed.snapshot) {
    aimed.offsets.reserve(aimed.beams().size());
    for (const Beam& beam : aimed.beams()) aimed.offsets.push_back(beam.time_offset);
  }
  // what a renderer of images sees has no parts
  const bool is_wide = returns_ && !footprint_.is_line() && !renderer.is_snapshot();
  return std::make_unique<OneScan>(*this, std::move(aimed), T_world_sensor, is_wide);
}

Scan Lidar::take(const ScanRequest& request,
                 const PoseTrack& T_world_sensor,
                 const Renderer& renderer,
                 const Executor& executor) const {
  const std::unique_ptr<Exposure> scan = aim(request, T_world_sensor, renderer, executor);
  const RenderJob job = scan->job();
  renderer.render({&job, 1}, executor);
  return scan->finish(executor);
}

}  // namespace pointflight
