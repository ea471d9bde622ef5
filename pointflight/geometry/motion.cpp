#include "pointflight/geometry/motion.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

/// A number in [low, high] that runs back and forth between the two.
double folded(double x, double low, double high) {
  const double width = high - low;
  if (width <= 0.0) return low;
  const double turns = (x - low) / (2.0 * width);
  const double within = 2.0 * width * (turns - std::floor(turns));
  return low + (within <= width ? within : 2.0 * width - within);
}

Vector3d folded(const Vector3d& p, const Aabb& walls) {
  return {folded(p.x(), walls.min.x(), walls.max.x()),
          folded(p.y(), walls.min.y(), walls.max.y()),
          folded(p.z(), walls.min.z(), walls.max.z())};
}

}  // namespace

PoseTrack::PoseTrack() : PoseTrack(Pose{}) {}

PoseTrack::PoseTrack(const Pose& T_world_body)
    : PoseTrack(std::vector<TimedPose>{{SimTime{}, T_world_body}}) {}

PoseTrack::PoseTrack(std::vector<TimedPose> records, bool repeats) : repeats_(repeats) {
  if (records.empty()) throw std::invalid_argument("a track needs a pose");
  const auto not_after = [](const TimedPose& a, const TimedPose& b) { return b.time <= a.time; };
  if (std::adjacent_find(records.begin(), records.end(), not_after) != records.end()) {
    throw std::invalid_argument("the times of a track must ascend");
  }
  records_ = std::make_shared<const std::vector<TimedPose>>(std::move(records));
}

PoseTrack PoseTrack::with_mount(const Pose& T_body_sensor) const {
  PoseTrack mounted = *this;
  mounted.mount_ = has_mount_ ? mount_ * T_body_sensor : T_body_sensor;
  mounted.has_mount_ = true;
  return mounted;
}

Pose PoseTrack::at(SimTime time) const {
  const std::vector<TimedPose>& r = *records_;
  const SimTime first = r.front().time;
  const SimTime last = r.back().time;
  if (repeats_ && time > last && last > first) time = first + (time - first) % (last - first);
  const auto body = [&] {
    if (time <= first) return r.front().pose;
    if (time >= last) return r.back().pose;
    const auto after = std::upper_bound(
        r.begin(), r.end(), time, [](SimTime t, const TimedPose& p) { return t < p.time; });
    const TimedPose& a = *(after - 1);
    const TimedPose& b = *after;
    return interpolate(a.pose, b.pose, to_seconds(time - a.time) / to_seconds(b.time - a.time));
  };
  return has_mount_ ? body() * mount_ : body();
}

double PoseTrack::speed_max(SimTime from, SimTime until) const {
  double most = 0.0;
  for (std::size_t i = 1; i < records_->size(); ++i) {
    const TimedPose& a = (*records_)[i - 1];
    const TimedPose& b = (*records_)[i];
    if (b.time < from || a.time > until) continue;
    const double moved = (b.pose.translation - a.pose.translation).norm();
    most = std::max(most, moved / to_seconds(b.time - a.time));
  }
  return most;
}

Pose StraightMotion::at(SimTime time) const {
  const Vector3d p = start + to_seconds(time - from) * velocity;
  return {Quaterniond::Identity(), walls.empty() ? p : folded(p, walls)};
}

Pose LoopMotion::at(SimTime time) const {
  if (!legs) return {};
  const Duration within = (time.time_since_epoch() % round + round) % round;
  const auto after = std::upper_bound(
      legs->begin(), legs->end(), within, [](Duration t, const Leg& leg) { return t < leg.start; });
  const Leg& leg = *(after - 1);
  return {leg.heading, leg.from + to_seconds(within - leg.start) * speed * leg.direction};
}

Pose pose_at(const Motion& motion, SimTime time) {
  return std::visit([&](const auto& m) { return m.at(time); }, motion);
}

double speed_max(const Motion& motion) {
  if (const auto* track = std::get_if<PoseTrack>(&motion)) {
    return track->speed_max(SimTime::min(), SimTime::max());
  }
  if (const auto* straight = std::get_if<StraightMotion>(&motion)) return straight->velocity.norm();
  return std::get<LoopMotion>(motion).speed;
}

}  // namespace pointflight
