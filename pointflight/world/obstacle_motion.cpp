#include "pointflight/world/obstacle_motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/csv_table.hpp"

namespace pointflight {

LoopMotion loop_through(const std::vector<Vector3d>& waypoints, double speed) {
  if (waypoints.empty() || !(speed > 0.0)) {
    throw InputError("a loop needs waypoints and a speed above 0");
  }
  std::vector<LoopMotion::Leg> legs;
  LoopMotion motion;
  motion.speed = speed;
  motion.round = Duration{0};
  Quaterniond heading = Quaterniond::Identity();
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    const Vector3d way = waypoints[(i + 1) % waypoints.size()] - waypoints[i];
    const double length = way.norm();
    if (length < 1e-9) continue;
    if (std::hypot(way.x(), way.y()) > 1e-9) {
      heading = quaternion_from_rpy(0.0, 0.0, math::atan2(way.y(), way.x()));
    }
    legs.push_back({motion.round, waypoints[i], way / length, heading});
    motion.round += from_seconds(length / speed);
  }
  if (legs.empty()) {
    legs.push_back({Duration{0}, waypoints.front(), Vector3d::Zero(), heading});
    motion.speed = 0.0;
  }
  motion.round = std::max(motion.round, Duration{1});
  motion.legs = std::make_shared<const std::vector<LoopMotion::Leg>>(std::move(legs));
  return motion;
}

PoseTrack read_keyframes(const std::string& path, bool repeat) {
  const MappedFile file(path);
  return parse_keyframes(as_text(file.bytes()), path, repeat);
}

PoseTrack parse_keyframes(std::string_view text, const std::string& name, bool repeat) {
  const CsvTable table(text, name);
  const int time = table.require("time");
  const int place[3] = {table.require("x"), table.require("y"), table.require("z")};
  const int quaternion[4] = {
      table.find("qw"), table.find("qx"), table.find("qy"), table.find("qz")};
  const int rpy[3] = {table.find("roll_deg"), table.find("pitch_deg"), table.find("yaw_deg")};
  std::vector<TimedPose> frames;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const auto number = [&](int column, double limit) {
      const double value = table.at(row, column);
      if (!(std::abs(value) <= limit)) {
        throw InputError(
            fmt::format("{}: a number is missing or beyond {}", table.location(row), limit));
      }
      return value;
    };
    TimedPose frame;
    frame.time = SimTime(from_seconds(number(time, 1e9)));
    for (int axis = 0; axis < 3; ++axis) frame.pose.translation[axis] = number(place[axis], 1e7);
    if (quaternion[0] >= 0 && quaternion[1] >= 0 && quaternion[2] >= 0 && quaternion[3] >= 0) {
      Quaterniond& q = frame.pose.rotation;
      q = Quaterniond(number(quaternion[0], 1e3),
                      number(quaternion[1], 1e3),
                      number(quaternion[2], 1e3),
                      number(quaternion[3], 1e3));
      if (!(q.norm() > 1e-6)) {
        throw InputError(fmt::format("{}: the quaternion is zero", table.location(row)));
      }
      q.normalize();
    } else {
      const auto angle = [&](int column) {
        return column < 0 ? 0.0 : kDegree * number(column, 1e6);
      };
      frame.pose.rotation = quaternion_from_rpy(angle(rpy[0]), angle(rpy[1]), angle(rpy[2]));
    }
    if (!frames.empty() && frame.time <= frames.back().time) {
      throw InputError(
          fmt::format("{}: time {} s does not come after {} s of the row before; sort the rows",
                      table.location(row),
                      to_seconds(frame.time),
                      to_seconds(frames.back().time)));
    }
    frames.push_back(frame);
  }
  const Vector3d& first = frames.front().pose.translation;
  if (repeat && (frames.back().pose.translation - first).norm() > 1e-6) {
    throw InputError(
        fmt::format("{}: repeats, but does not end where it starts: it would jump; add "
                    "a last row at ({}, {}, {})",
                    table.location(table.rows() - 1),
                    first.x(),
                    first.y(),
                    first.z()));
  }
  return PoseTrack(std::move(frames), repeat);
}

}  // namespace pointflight
