#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pointflight/geometry/motion.hpp"

namespace pointflight {

/// Where an obstacle is: a function of time alone, so that all processes agree on it without
/// traffic.
///
/// To add one: derive, write its file in world/, one line in `make_motion` (obstacles.cpp), its
/// keys in ObstacleSettings, a test of its speed and of its poses.
class ObstacleMotion {
 public:
  virtual ~ObstacleMotion() = default;

  /// T_world_body. Callable from several threads.
  [[nodiscard]] virtual Pose at(SimTime time) const = 0;

  /// No point of the motion is faster, m/s.
  [[nodiscard]] virtual double speed_max() const = 0;
};

/// Along straight legs through waypoints at constant speed, its x axis ahead (level), from the last
/// back to the first and on.
class WaypointLoop : public ObstacleMotion {
 public:
  /// At least one waypoint, speed > 0.
  WaypointLoop(const std::vector<Vector3d>& waypoints_world, double speed);

  [[nodiscard]] Pose at(SimTime time) const override;
  [[nodiscard]] double speed_max() const override { return speed_; }

 private:
  struct Leg {
    Duration start;  ///< Since the round's.
    Vector3d from;
    Vector3d direction;
    Quaterniond heading;
  };
  std::vector<Leg> legs_;
  double speed_;
  Duration round_{0};
};

/// Poses at given times, between them linear in position and along the shorter arc in rotation.
class Keyframes : public ObstacleMotion {
 public:
  /// CSV with the columns time, x, y, z (s, m) and, where it turns, roll_deg, pitch_deg, yaw_deg or
  /// qw, qx, qy, qz. Times ascend. With `repeat` it starts again after the last; without, it stays
  /// there. Throws InputError with file and line.
  static std::unique_ptr<Keyframes> read(const std::string& path, bool repeat);
  /// The same from text; `name` stands for the path in messages.
  static std::unique_ptr<Keyframes> parse(std::string_view text,
                                          const std::string& name,
                                          bool repeat);

  [[nodiscard]] Pose at(SimTime time) const override;
  [[nodiscard]] double speed_max() const override { return speed_max_; }

 private:
  struct Frame {
    SimTime time;
    Pose pose;
  };
  std::vector<Frame> frames_;
  double speed_max_ = 0.0;
  bool repeat_ = false;
};

}  // namespace pointflight
