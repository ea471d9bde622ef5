#include "pointflight/render/sensor_beams.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "pointflight/core/argument.hpp"
#include "pointflight/render/internal/aim_kernel.hpp"

namespace pointflight {
namespace {

/// Calls `action(at, made)` with room for some beams at a time, as many as stay in the nearest
/// cache.
template <class Action>
void for_some(std::size_t count, const Action& action) {
  std::array<AimedBeam, 64> made;  // NOLINT(cppcoreguidelines-pro-type-member-init): written there
  for (std::size_t at = 0; at < count; at += made.size()) {
    action(at, std::span(made).first(std::min(made.size(), count - at)));
  }
}

}  // namespace

Vector3f horizontal_across(const Vector3f& direction_sensor) {
  const float level = std::hypot(direction_sensor.x(), direction_sensor.y());
  if (level < 1e-6f) return Vector3f::UnitY();
  return {-direction_sensor.y() / level, direction_sensor.x() / level, 0.0f};
}

AimedBeams aim_beams(std::shared_ptr<const SensorBeams> beams,
                     std::span<const Pose> T_world_sensor,
                     float range_max) {
  const std::size_t count = T_world_sensor.size();
  require_argument(count == 1 || count == std::size_t{beams->pieces} + 1,
                   "aim_beams: one pose, or one at each end of a piece");
  AimedBeams aimed;
  aimed.beams = std::move(beams);
  aimed.range_max = range_max;
  aimed.position_world = T_world_sensor[0].translation;
  aimed.poses.resize(count);
  Eigen::Vector4d before = T_world_sensor[0].rotation.coeffs();
  for (std::size_t i = 0; i < count; ++i) {
    const Pose& pose = T_world_sensor[i];
    const Vector3d shift = pose.translation - aimed.position_world;
    const Eigen::Vector4d q = pose.rotation.coeffs();  // x y z w
    before = before.dot(q) < 0.0 ? Eigen::Vector4d(-q) : q;
    for (int k = 0; k < 4; ++k) aimed.poses[i].rotation[k] = static_cast<float>(before[k]);
    for (int k = 0; k < 3; ++k) aimed.poses[i].shift[k] = static_cast<float>(shift[k]);
  }
  return aimed;
}

void make_rays(const AimedBeams& aimed, std::size_t begin, std::span<Ray> rays) {
  for_some(rays.size(), [&](std::size_t at, std::span<AimedBeam> made) {
    aim_some(aimed, begin + at, made, false);
    for (std::size_t i = 0; i < made.size(); ++i) {
      const AimedBeam& beam = made[i];
      const Vector3f shift(beam.shift[0], beam.shift[1], beam.shift[2]);
      rays[at + i] = {aimed.position_world + shift.cast<double>(),
                      {beam.direction[0], beam.direction[1], beam.direction[2]},
                      aimed.range_max * aimed.beams->beams[begin + at + i].stretch};
    }
  });
}

void make_across(const AimedBeams& aimed, std::size_t begin, std::span<Vector3f> across) {
  for_some(across.size(), [&](std::size_t at, std::span<AimedBeam> made) {
    aim_some(aimed, begin + at, made, true);
    for (std::size_t i = 0; i < made.size(); ++i) {
      across[at + i] = {made[i].across[0], made[i].across[1], made[i].across[2]};
    }
  });
}

}  // namespace pointflight
