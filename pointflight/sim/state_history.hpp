#pragma once

#include <deque>

#include "pointflight/geometry/motion.hpp"

namespace pointflight {

/// Poses of a body as a run goes on, of which scans in arrears get tracks. States may come from the
/// local dynamics or from anywhere else. A value.
class StateHistory {
 public:
  /// Instants must increase.
  void record(SimTime time, const Pose& T_world_body);

  /// Forgets what is not needed for instants at or after `time`.
  void forget_before(SimTime time);

  /// Forgets all: what comes next does not go on from it.
  void clear() { records_.clear(); }

  /// Where it was in [from, until]: the first or last record outside what is known. Safe to call
  /// from several threads; not before the first record.
  [[nodiscard]] PoseTrack track(SimTime from, SimTime until) const;

 private:
  std::deque<TimedPose> records_;
};

}  // namespace pointflight
