#include "pointflight/sim/state_history.hpp"

#include <algorithm>
#include <cassert>

#include "pointflight/geometry/rotation.hpp"

namespace pointflight {

void StateHistory::record(SimTime time, const Pose& T_world_body) {
  assert(records_.empty() || records_.back().time < time);
  records_.push_back({time, T_world_body});
}

void StateHistory::forget_before(SimTime time) {
  while (records_.size() > 2 && records_[1].time <= time) records_.pop_front();
}

Pose StateHistory::at(SimTime time) const {
  assert(!records_.empty());
  if (time <= records_.front().time) return records_.front().pose;
  if (time >= records_.back().time) return records_.back().pose;
  const auto after =
      std::upper_bound(records_.begin(), records_.end(), time, [](SimTime t, const Record& r) {
        return t < r.time;
      });
  const Record& a = *(after - 1);
  const Record& b = *after;
  const double share = to_seconds(time - a.time) / to_seconds(b.time - a.time);
  return interpolate(a.pose, b.pose, share);
}

double StateHistory::speed_max(SimTime from, SimTime until) const {
  double most = 0.0;
  for (std::size_t i = 1; i < records_.size(); ++i) {
    const Record& a = records_[i - 1];
    const Record& b = records_[i];
    if (b.time < from || a.time > until) continue;
    const double moved = (b.pose.translation - a.pose.translation).norm();
    most = std::max(most, moved / to_seconds(b.time - a.time));
  }
  return most;
}

}  // namespace pointflight
