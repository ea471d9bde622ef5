#include "pointflight/learn/range_pattern.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "pointflight/core/argument.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/render/internal/direction_order.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kRaysAtOnce = 1 << 16;     // of whole vehicles
constexpr std::size_t kRaysOfDevices = 1 << 22;  // the same, of renderers that want many
constexpr std::uint32_t kPieces = 8;             // of a period, in which a vehicle turns evenly

/// What moves around a vehicle, for as long as its rays are under way.
struct Around {
  std::vector<Body> bodies;
  std::vector<Duration> offsets;
};

}  // namespace

RangePattern::RangePattern(std::vector<Vector3f> directions,
                           std::vector<float> shares,
                           float range_max,
                           std::size_t pooled)
    : shares_(std::move(shares)), range_max_(range_max), pooled_(pooled) {
  require_argument(range_max > 0.0f, "RangePattern: a range above 0");
  require_argument(pooled >= 1 && directions.size() % pooled == 0,
                   "RangePattern: whole groups of directions");
  require_argument(shares_.empty() || shares_.size() == directions.size(),
                   "RangePattern: a share for each direction");
  for (const Vector3f& direction : directions) {
    require_argument(std::abs(direction.norm() - 1.0f) < 1e-4f, "RangePattern: unit vectors");
  }
  for (const float share : shares_) {
    require_argument(share >= 0.0f && share <= 1.0f, "RangePattern: shares from 0 to 1");
  }
  auto beams = std::make_shared<SensorBeams>();
  beams->pieces = kPieces;
  beams->order = direction_order(directions, Executor(1));
  for (std::size_t k = 0; k < directions.size(); ++k) {
    const Vector3f& d = directions[k];
    const Vector3f across = horizontal_across(d);
    const float at = shares_.empty() ? 0.0f : shares_[k] * static_cast<float>(kPieces);
    const float piece = std::min(std::floor(at), static_cast<float>(kPieces - 1));
    beams->beams.push_back({{d.x(), d.y(), d.z()},
                            {0.0f, 0.0f, 0.0f},
                            {across.x(), across.y()},
                            1.0f,
                            at - piece,
                            static_cast<std::uint32_t>(piece),
                            static_cast<std::uint32_t>(k)});
  }
  beams_ = std::move(beams);
}

AimedBeams RangePattern::aimed(const PosePair& poses) const {
  if (shares_.empty()) return aim_beams(beams_, {&poses.now, 1}, range_max_);
  std::array<Pose, kPieces + 1> all;
  for (std::size_t k = 0; k <= kPieces; ++k) {
    all[k] = interpolate(poses.before, poses.now, static_cast<double>(k) / kPieces);
  }
  return aim_beams(beams_, all, range_max_);
}

/// Of each direction since the start of the period; empty if all are measured at its end.
std::vector<Duration> RangePattern::offsets(const PosePair& poses) const {
  std::vector<Duration> offsets;
  offsets.reserve(shares_.size());
  const double period = to_seconds(poses.time - poses.before_time);
  for (const float share : shares_) {
    offsets.push_back(from_seconds(static_cast<double>(share) * period));
  }
  return offsets;
}

/// Ranges become those that the sensor reports.
void RangePattern::report(std::span<Hit> hits, const ScanAddress& address) const {
  const std::size_t most = most_returns(returns_->mode());
  std::vector<Return> made(hits.size() * most);
  returns_->measure(
      std::span<const Hit>(hits), ReturnChances(address, true).of(0, hits.size()), made);
  for (std::size_t k = 0; k < hits.size(); ++k) {
    float nearest = std::numeric_limits<float>::infinity();
    for (const Return& one : std::span(made).subspan(k * most, most)) {
      if (one.is_return()) nearest = std::min(nearest, one.range);
    }
    hits[k].range = nearest < range_max_ ? nearest : Hit{}.range;
  }
}

void RangePattern::measure(const Renderer& renderer,
                           std::span<const PosePair> poses,
                           std::span<const std::uint32_t> vehicles,
                           std::span<float> ranges,
                           const Executor& executor,
                           const BodiesOf& bodies_of,
                           const DrawsOf& draws_of) const {
  const std::size_t beams = beams_->beams.size();
  if (beams == 0) return;
  require_argument(!returns_ || draws_of, "RangePattern: a sensor's reports need draws");
  const std::size_t rays = renderer.jobs_at_once() > 0 ? kRaysOfDevices : kRaysAtOnce;
  const std::size_t at_once = std::max<std::size_t>(1, rays / beams);
  const std::size_t most = std::min(at_once, vehicles.size());
  const bool wants_hits = bodies_of || returns_;
  std::vector<AimedBeams> all_aimed(most);
  std::vector<Hit> hits(wants_hits ? most * beams : 0);
  std::vector<float> found(wants_hits ? 0 : most * beams);
  std::vector<RenderJob> jobs;
  std::vector<Around> around;
  for (std::size_t first = 0; first < vehicles.size(); first += at_once) {
    const std::size_t count = std::min(at_once, vehicles.size() - first);
    jobs.assign(count, RenderJob{});
    around.assign(bodies_of ? count : 0, Around{});
    executor.parallel_for(count, 1, [&](std::size_t i, std::size_t) {
      const PosePair& pair = poses[vehicles[first + i]];
      all_aimed[i] = aimed(pair);
      jobs[i].batch.aimed = &all_aimed[i];
      jobs[i].batch.order = beams_->order;
      jobs[i].batch.T_world_sensor = pair.now;
      jobs[i].batch.range_max = range_max_;
      if (draws_of) {
        const ScanAddress at = draws_of(vehicles[first + i]);
        jobs[i].batch.draws = {at.seed, at.sensor, at.scan};
      }
      if (wants_hits) {
        jobs[i].hits = std::span(hits).subspan(i * beams, beams);
      } else {
        jobs[i].ranges = std::span(found).subspan(i * beams, beams);
      }
      if (!bodies_of) return;
      around[i] = {bodies_of(vehicles[first + i]), offsets(pair)};
      jobs[i].batch.bodies = around[i].bodies;
      jobs[i].batch.time_offsets = around[i].offsets;
      jobs[i].batch.time = shares_.empty() ? pair.time : pair.before_time;
      jobs[i].batch.snapshot_time = pair.time;
    });
    renderer.render(jobs, executor);
    executor.parallel_for(count, 1, [&](std::size_t i, std::size_t) {
      const std::span row = ranges.subspan(vehicles[first + i] * size(), size());
      std::fill(row.begin(), row.end(), 1.0f);
      if (returns_) report(jobs[i].hits, draws_of(vehicles[first + i]));
      for (std::size_t k = 0; k < beams; ++k) {
        const float range = wants_hits ? jobs[i].hits[k].range : jobs[i].ranges[k];
        float& least = row[k / pooled_];
        if (range >= 0.0f) least = std::min(least, range / range_max_);
      }
    });
  }
}

}  // namespace pointflight
