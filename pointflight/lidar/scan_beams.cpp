#include "pointflight/lidar/scan_beams.hpp"

#include <algorithm>
#include <utility>

#include "pointflight/core/floor.hpp"
#include "pointflight/render/internal/direction_order.hpp"

namespace pointflight {
namespace {

/// Pieces of a scan within which a sensor moves straight and turns evenly are no longer.
constexpr Duration kLongestPiece{1'000'000};

std::shared_ptr<const SensorBeams> in_sensor(const ScanBeams::Ordered& made,
                                             Duration period,
                                             bool measures_depth) {
  auto all = std::make_shared<SensorBeams>();
  const std::int64_t pieces = std::max<std::int64_t>(1, (period - Duration{1}) / kLongestPiece + 1);
  all->pieces = static_cast<std::uint32_t>(pieces);
  all->order = made.order;
  all->beams.reserve(made.beams.size());
  const double per_second = static_cast<double>(pieces) / to_seconds(period);
  for (const Beam& beam : made.beams) {
    const Vector3f& d = beam.direction_sensor;
    const Vector3f& o = beam.origin_sensor;
    const Vector3f across = horizontal_across(d);
    const double at = to_seconds(beam.time_offset) * per_second;
    const auto piece = std::clamp<std::int64_t>(floor_to_integer(at), 0, pieces - 1);
    all->has_origins = all->has_origins || !o.isZero(0.0f);
    all->beams.push_back({{d.x(), d.y(), d.z()},
                          {o.x(), o.y(), o.z()},
                          {across.x(), across.y()},
                          measures_depth ? 1.0f / d.x() : 1.0f,
                          static_cast<float>(at - static_cast<double>(piece)),
                          static_cast<std::uint32_t>(piece),
                          static_cast<std::uint32_t>(all->beams.size())});
  }
  return all;
}

}  // namespace

ScanBeams::ScanBeams(const LidarSettings& settings, std::unique_ptr<BeamPattern> pattern)
    : pattern_(std::move(pattern)),
      period_(from_seconds(1.0 / settings.rate)),
      measures_depth_(settings.measures_depth()) {}

std::shared_ptr<const ScanBeams::Ordered> ScanBeams::of(std::uint64_t index,
                                                        const Executor& executor) const {
  if (pattern_->repeats()) index = 0;
  {
    const std::lock_guard lock(mutex_);
    for (const Kept& kept : kept_) {
      if (kept.beams && kept.index == index) return kept.beams;
    }
  }
  // without the lock: a thread that waits for its helpers may be given another vehicle's scan
  auto made = std::make_shared<Ordered>();
  made->beams = pattern_->beams(index, executor);
  if (pattern_->repeats()) {
    std::vector<Vector3f> directions;
    directions.reserve(made->beams.size());
    for (const Beam& beam : made->beams) directions.push_back(beam.direction_sensor);
    made->order = direction_order(directions, executor);
  }
  made->in_sensor = in_sensor(*made, period_, measures_depth_);
  const std::lock_guard lock(mutex_);
  for (const Kept& kept : kept_) {
    if (kept.beams && kept.index == index) return kept.beams;  // another thread made the same
  }
  kept_[next_] = {index, made};
  next_ = (next_ + 1) % kKept;
  return made;
}

}  // namespace pointflight
