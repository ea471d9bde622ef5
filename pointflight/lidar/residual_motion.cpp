#include "pointflight/lidar/residual_motion.hpp"

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"

namespace pointflight {
namespace {

// s between draws: scans of a real hall a second apart correlate by 0.47 in rotation and 0.59 in
// translation, and draws 1.5 s apart by 0.58 over a second
constexpr double kApart = 1.5;

}  // namespace

Vector3f ResidualMotion::moved(const Vector3f& point_sensor, double time) const {
  const Vector3d point = point_sensor.cast<double>();
  return (point + (time - 0.5) * (rotation.cross(point) + translation)).cast<float>();
}

ResidualMotion residual_motion(const DeskewingSettings& settings,
                               std::uint64_t seed,
                               std::uint32_t sensor,
                               SimTime start) {
  const RandomStream random(seed, StreamId::kLidarDeskewing, sensor);
  const double t = to_seconds(start.time_since_epoch()) / kApart;
  const auto draw = [&](std::uint64_t which) { return random.moving_normal(t, which, 6); };
  ResidualMotion motion;
  motion.rotation = settings.rotation_sigma_deg * kDegree * Vector3d(draw(0), draw(1), draw(2));
  motion.translation = settings.translation_sigma * Vector3d(draw(3), draw(4), draw(5));
  return motion;
}

}  // namespace pointflight
