// How obstacles move: functions of time alone, so that all processes agree on them without traffic.
// To add one: a function that makes a `Motion` (a track of poses does for most), one line in
// `motion_of` (obstacles.cpp), its keys in ObstacleSettings, a test of its speed and of its poses.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pointflight/geometry/motion.hpp"

namespace pointflight {

/// Along straight legs through waypoints (world, m) at constant speed (m/s), the x axis ahead
/// (level), from the last back to the first and on. Throws InputError without waypoints or speed.
LoopMotion loop_through(const std::vector<Vector3d>& waypoints_world, double speed);

/// Poses at given times from a CSV with the columns time, x, y, z (s, m) and, where it turns,
/// roll_deg, pitch_deg, yaw_deg or qw, qx, qy, qz. Times ascend. With `repeat` it starts again
/// after the last; without, it stays there. Throws InputError with file and line.
PoseTrack read_keyframes(const std::string& path, bool repeat);
/// The same from text; `name` stands for the path in messages.
PoseTrack parse_keyframes(std::string_view text, const std::string& name, bool repeat);

}  // namespace pointflight
