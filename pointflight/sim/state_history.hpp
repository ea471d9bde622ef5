#pragma once

#include <deque>

#include "pointflight/core/time.hpp"
#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Poses of a body at recorded instants, interpolated between them: what scans in arrears look up.
/// States may come from the local dynamics or from anywhere else. A value.
class StateHistory {
 public:
  /// Instants must increase.
  void record(SimTime time, const Pose& T_world_body);

  /// Forgets what is not needed for instants at or after `time`.
  void forget_before(SimTime time);

  /// T_world_body: linear in position and nearly constant-rate in rotation between the two records
  /// around `time`; the first or last record outside them. Safe to call from several threads.
  [[nodiscard]] Pose at(SimTime time) const;

  /// The greatest speed between records that matter for [from, until], m/s.
  [[nodiscard]] double speed_max(SimTime from, SimTime until) const;

  /// True before the first record; `at` must not be called then.
  [[nodiscard]] bool empty() const { return records_.empty(); }

 private:
  struct Record {
    SimTime time;
    Pose pose;
  };
  std::deque<Record> records_;
};

}  // namespace pointflight
