#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pointflight/geometry/types.hpp"
#include "pointflight/vehicle/trajectory.hpp"

namespace pointflight {

/// Limits of a smooth move.
struct MotionLimits {
  double speed = 2.0;         ///< m/s
  double acceleration = 2.0;  ///< m/s^2
  double jerk = 4.0;          ///< m/s^3

  /// Exact: for orders that are said again.
  bool operator==(const MotionLimits&) const = default;
};

/// Rest-to-rest move over a distance with limited speed, acceleration and jerk: the double-S
/// profile of seven phases (Biagiotti, Melchiorri, Trajectory Planning for Automatic Machines,
/// 2008, 3.4).
class SmoothMove {
 public:
  SmoothMove() = default;
  /// `distance` >= 0; the limits must be positive. Peak speed shrinks if the distance is short.
  SmoothMove(double distance, const MotionLimits& limits);

  /// A position on the move, along it.
  struct Sample {
    double position;      ///< m
    double speed;         ///< m/s
    double acceleration;  ///< m/s^2
    double jerk;          ///< m/s^3
  };
  /// At `t` seconds after the start; at rest before and after.
  [[nodiscard]] Sample at(double t) const;
  /// Seconds from rest to rest; 0 for no distance.
  [[nodiscard]] double duration() const { return 4.0 * t_jerk_ + 2.0 * t_steady_ + t_cruise_; }

 private:
  double distance_ = 0.0;
  double jerk_ = 1.0;
  double t_jerk_ = 0.0;    ///< Of each jerk phase.
  double t_steady_ = 0.0;  ///< At constant acceleration.
  double t_cruise_ = 0.0;
};

/// Where a mission looks.
enum class YawMode {
  kAlongPath,  ///< To the next waypoint.
  kFixed,      ///< Where it looked at the start.
};

/// Waypoints and how to fly through them: a scenario's `mission`.
struct MissionSettings {
  MotionLimits motion;                ///< Of the straight legs.
  YawMode yaw = YawMode::kAlongPath;  ///< Where it looks.
  double yaw_rate_deg = 90.0;         ///< Limit while turning.
  double hold = 0.0;                  ///< Seconds at each waypoint.
  std::vector<Vector3d> waypoints;    ///< World, m; empty: hover.
  std::optional<double> final_yaw;    ///< Heading to turn to in the end, rad.

  /// Exact: for orders that are said again.
  bool operator==(const MissionSettings&) const = default;
};

/// Flies straight legs between waypoints, smooth in time and at rest at each, turning towards the
/// next before it leaves. A pure function of time.
class Mission : public Trajectory {
 public:
  Mission() = default;
  /// Everything finite, the limits positive.
  Mission(const Vector3d& start, double yaw, const MissionSettings& settings);

  [[nodiscard]] PositionCommand at(double t) const override;
  [[nodiscard]] double duration() const override { return duration_; }
  [[nodiscard]] double length() const { return length_; }  ///< m
  /// The last waypoint, or the start without any; world, m.
  [[nodiscard]] const Vector3d& goal() const { return goal_; }

 private:
  struct Leg {
    double start = 0.0;  ///< s
    Vector3d from;
    Vector3d direction;
    double yaw_from = 0.0;
    double yaw_sign = 1.0;
    SmoothMove turn;
    SmoothMove travel;
  };
  std::vector<Leg> legs_;
  Vector3d goal_ = Vector3d::Zero();
  double yaw_ = 0.0;
  double duration_ = 0.0;
  double length_ = 0.0;
};

}  // namespace pointflight
