#include "pointflight/sim/state_history.hpp"

#include <algorithm>
#include <cassert>

namespace pointflight {

void StateHistory::record(SimTime time, const Pose& T_world_body) {
  assert(records_.empty() || records_.back().time < time);
  records_.push_back({time, T_world_body});
}

void StateHistory::forget_before(SimTime time) {
  while (records_.size() > 2 && records_[1].time <= time) records_.pop_front();
}

PoseTrack StateHistory::track(SimTime from, SimTime until) const {
  assert(!records_.empty());
  // with one record before and one after, whose speeds matter too
  const auto earlier = [](const TimedPose& record, SimTime time) { return record.time < time; };
  const auto later = [](SimTime time, const TimedPose& record) { return time < record.time; };
  auto first = std::lower_bound(records_.begin(), records_.end(), from, earlier);
  if (first != records_.begin()) --first;
  auto last = std::upper_bound(first, records_.end(), until, later);
  if (last != records_.end()) ++last;
  return PoseTrack({first, last});
}

}  // namespace pointflight
