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
#include "pointflight/lidar/internal/direction_kernel.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kChunk = 2048;         // beams
constexpr std::uint32_t kPhases = 1u << 20;  // scans: a day of 10 Hz

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

/// Each beam from the pose at its own time, those of a snapshot from the one in the middle.
void Lidar::aim_beams(const PoseTrack& T_world_sensor,
                      Aimed& aimed,
                      const Executor& executor) const {
  const std::vector<Beam>& beams = aimed.beams();
  const ScanRequest& request = aimed.request;
  const bool snapshot = aimed.snapshot;
  aimed.rays.resize(beams.size());
  aimed.offsets.resize(request.bodies.empty() || snapshot ? 0 : beams.size());
  aimed.across.resize(returns_ && !footprint_.is_line() ? beams.size() : 0);
  const auto range_max = static_cast<float>(range_limit());
  executor.parallel_for(beams.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    Vector3d position = aimed.middle.translation;
    Matrix3d rotation = aimed.middle.rotation.toRotationMatrix();
    Duration pose_time{-1};
    for (std::size_t i = begin; i < end; ++i) {
      if (!snapshot && beams[i].time_offset != pose_time) {
        pose_time = beams[i].time_offset;
        const Pose pose = T_world_sensor.at(request.start + pose_time);
        position = pose.translation;
        rotation = pose.rotation.toRotationMatrix();
      }
      Ray& ray = aimed.rays[i];
      ray.origin_world = turned(rotation, beams[i].origin_sensor) + position;
      ray.direction_world = turned(rotation, beams[i].direction_sensor).cast<float>().normalized();
      ray.range_max = range_max / depth_share(beams[i]);
      if (!aimed.offsets.empty()) aimed.offsets[i] = beams[i].time_offset;
      if (!aimed.across.empty()) {
        aimed.across[i] = turned(rotation, across(beams[i].direction_sensor)).cast<float>();
      }
    }
  });
}

/// Turns each ray by the noise of its direction. The sensor knows nothing of it: points lie where
/// the beams should have gone.
void Lidar::add_direction_noise(Aimed& aimed, const Executor& executor) const {
  const ScanRequest& request = aimed.request;
  std::vector<Ray>& rays = aimed.rays;
  const double sigma = settings_.optics.angle_sigma_deg * kDegree;
  if (sigma <= 0.0) return;
  const RandomStream random(request.seed, StreamId::kLidarAngle, sensor_);
  executor.parallel_for(rays.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    // NOLINTBEGIN(cppcoreguidelines-pro-type-member-init): written on the next lines
    std::array<double, kChunk> us;
    std::array<double, kChunk> vs;
    // NOLINTEND(cppcoreguidelines-pro-type-member-init)
    random.normal2(request.index << 32 | begin,
                   std::span(us).first(end - begin),
                   std::span(vs).first(end - begin));
    turn_rays(rays.data() + begin, end - begin, us.data(), vs.data(), sigma);
  });
}

RayBatch Lidar::batch_of(const Aimed& aimed) const {
  const SimTime middle = aimed.request.start + period() / 2;
  RayBatch batch;
  batch.rays = aimed.rays;
  batch.order = aimed.ordered->order;
  batch.T_world_sensor = aimed.middle;
  batch.range_max = static_cast<float>(reach());
  batch.bodies = aimed.request.bodies;
  batch.snapshot_time = middle;
  batch.time = aimed.snapshot ? middle : aimed.request.start;
  batch.time_offsets = aimed.offsets;
  batch.image_resolution = settings_.image_resolution_deg * kDegree;
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
        hits_(is_wide ? 0 : aimed_.rays.size()),
        echoes_(is_wide ? aimed_.rays.size() : 0) {}
  OneScan(const OneScan&) = delete;  // the job refers to the rays
  OneScan& operator=(const OneScan&) = delete;

  RenderJob job() override {
    RenderJob job{lidar_.batch_of(aimed_), hits_, std::nullopt};
    if (is_wide_) job.wide = lidar_.footprint_.beams(aimed_.across, *lidar_.returns_, echoes_);
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
  aim_beams(T_world_sensor, aimed, executor);
  if (returns_ && request.noise) add_direction_noise(aimed, executor);
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
