#include "pointflight/ros/common/map_frame.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace pointflight {
namespace {

constexpr double kFar = 8192.0;   // m: from here on float32 has steps of 1 mm and more
constexpr double kRound = 100.0;  // m, of the frame's origin

bool names(const RosProfile& profile, const std::string& frame) {
  const auto is_it = [&](const std::string& other) { return bare_frame(other) == frame; };
  return is_it(profile.world_frame) || is_it(profile.world_alias) || is_it(profile.body_frame) ||
         is_it(profile.sensor_frame) ||
         std::any_of(profile.outputs.begin(), profile.outputs.end(), [&](const RosOutput& output) {
           return is_it(output.frame) || is_it(output.child_frame);
         });
}

}  // namespace

MapFrame map_frame_for(const Aabb& bounds_world, const RosProfile& profile) {
  MapFrame frame;
  if (bounds_world.empty()) return frame;
  double farthest = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = bounds_world.min[axis];
    const double high = bounds_world.max[axis];
    const double far = std::max(std::abs(low), std::abs(high));
    if (far < kFar) continue;
    farthest = std::max(farthest, far);
    frame.origin[axis] = kRound * std::round(0.5 * (low + high) / kRound);
  }
  if (frame.origin.isZero()) return frame;
  const auto single = static_cast<float>(farthest);
  frame.step = static_cast<double>(std::nextafter(single, 2.0f * single) - single);
  frame.name = names(profile, "map") ? "map_origin" : "map";
  return frame;
}

std::optional<std::string> note_of(const MapFrame& frame,
                                   const RosProfile& profile,
                                   const std::string& map_path) {
  if (!frame.is_used()) return std::nullopt;
  const std::string origin =
      fmt::format("{},{},{}", frame.origin.x(), frame.origin.y(), frame.origin.z());
  return fmt::format(
      "the map lies far from zero, where points in single precision would be {:.2g} m apart: "
      "clouds in the world are in "
      "frame {}, whose zero is at {} of {} (tf_static); for programs that take all frames for one, "
      "move the map: pointflight map transform {} -o near.pfmap --origin {}",
      frame.step,
      frame.name,
      origin,
      profile.world_frame,
      map_path,
      origin);
}

}  // namespace pointflight
