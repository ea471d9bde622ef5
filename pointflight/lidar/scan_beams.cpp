#include "pointflight/lidar/scan_beams.hpp"

#include "pointflight/render/internal/direction_order.hpp"

namespace pointflight {

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
  const std::lock_guard lock(mutex_);
  for (const Kept& kept : kept_) {
    if (kept.beams && kept.index == index) return kept.beams;  // another thread made the same
  }
  kept_[next_] = {index, made};
  next_ = (next_ + 1) % kKept;
  return made;
}

}  // namespace pointflight
