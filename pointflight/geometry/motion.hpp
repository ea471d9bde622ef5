// How things move, as data: motions can be kept, compared, sent to another process and uploaded.
#pragma once

#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "pointflight/core/time.hpp"
#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Where something was at an instant.
struct TimedPose {
  SimTime time;  ///< Since the start of the run.
  Pose pose;     ///< T_world_body
};

/// Poses at recorded instants, interpolated between them. Copies share the records.
class PoseTrack {
 public:
  /// At the origin, all the time.
  PoseTrack();
  /// Stands still.
  explicit PoseTrack(const Pose& T_world_body);
  /// At least one record; their times ascend. With `repeats` it starts again after the last one.
  /// Throws std::invalid_argument.
  explicit PoseTrack(std::vector<TimedPose> records, bool repeats = false);

  /// The track of a frame that is rigidly mounted on this one.
  [[nodiscard]] PoseTrack with_mount(const Pose& T_body_sensor) const;

  /// T_world_body, or T_world_sensor with a mount. Callable from several threads.
  [[nodiscard]] Pose at(SimTime time) const;

  /// The greatest speed between records that matter for [from, until], m/s; without the mount.
  [[nodiscard]] double speed_max(SimTime from, SimTime until) const;

  /// What it is made of, without the mount.
  [[nodiscard]] std::span<const TimedPose> records() const { return *records_; }
  /// It starts again after its last record.
  [[nodiscard]] bool repeats() const { return repeats_; }
  /// T_body_sensor; the identity without one.
  [[nodiscard]] const Pose& mount() const { return mount_; }

 private:
  std::shared_ptr<const std::vector<TimedPose>> records_;
  Pose mount_;
  bool has_mount_ = false;
  bool repeats_ = false;
};

/// Straight ahead at constant speed without turning; between walls it runs to and fro.
struct StraightMotion {
  SimTime from;                               ///< When it is at `start`.
  Vector3d start = Vector3d::Zero();          ///< World, m.
  Vector3d velocity = Vector3d::Zero();       ///< World, m/s.
  Aabb walls;                                 ///< Empty: none.
  [[nodiscard]] Pose at(SimTime time) const;  ///< T_world_body
};

/// A closed loop of straight legs at constant speed, each with a heading of its own.
struct LoopMotion {
  /// From one corner to the next.
  struct Leg {
    Duration start;                                 ///< Since the round's.
    Vector3d from = Vector3d::Zero();               ///< World, m.
    Vector3d direction = Vector3d::Zero();          ///< Unit length; zero: stays there.
    Quaterniond heading = Quaterniond::Identity();  ///< q_world_body
  };
  std::shared_ptr<const std::vector<Leg>> legs;  ///< By start, the first at 0; null: at the origin.
  double speed = 0.0;                            ///< m/s
  Duration round{1};                             ///< How long all legs take.
  [[nodiscard]] Pose at(SimTime time) const;     ///< T_world_body
};

/// Any of them.
using Motion = std::variant<PoseTrack, StraightMotion, LoopMotion>;

/// T_world_body at an instant. Callable from several threads.
[[nodiscard]] Pose pose_at(const Motion& motion, SimTime time);
/// It is never faster, m/s.
[[nodiscard]] double speed_max(const Motion& motion);

}  // namespace pointflight
