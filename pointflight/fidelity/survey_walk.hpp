// The way of a person who surveys a scene.
#pragma once

#include <cstdint>
#include <vector>

#include "pointflight/geometry/motion.hpp"
#include "pointflight/scenes/exact_scene.hpp"
#include "pointflight/scenes/scene_tree.hpp"

namespace pointflight {

/// How a scene is surveyed.
struct SurveyOptions {
  double seconds = 60.0;    ///< Of the walk.
  double speed = 1.0;       ///< m/s
  double tilt_deg = 15.0;   ///< The sensor looks down ahead: level, it would miss the near ground.
  double noise = 0.01;      ///< Deviation of the ranges, m.
  double shake = 0.005;     ///< Deviation of each scan's believed position, per axis, m.
  double shake_deg = 0.03;  ///< Of its believed attitude, about each axis.
  /// By how much believed positions drift from the start to the middle of the walk, m. At the end,
  /// which closes the loop, they are right again.
  double drift = 0.0;
  /// Corners of the walk, world, m; empty: random legs for `seconds`. Beyond its last corner it
  /// stands.
  std::vector<Vector3d> way;
  std::uint64_t seed = 1;  ///< Of the way and all noise.
};

/// Entities of the random streams of a survey.
namespace survey_draws {
inline constexpr std::uint32_t kWay = 0;     ///< Places to walk by.
inline constexpr std::uint32_t kShake = 1;   ///< Errors of poses.
inline constexpr std::uint32_t kPlaces = 2;  ///< Places to judge from.
inline constexpr std::uint32_t kDrift = 3;   ///< Directions of the drift.
}  // namespace survey_draws

/// A walk along `options.way` or, at chest height (1.2 to 1.8 m above what is below), along
/// straight legs 0.4 m from everything: T_world_sensor every `scan_period`, one pose more than
/// there are scans. Throws InputError if the scene has no such way.
std::vector<TimedPose> make_walk(const ExactScene& scene,
                                 const SceneTree& tree,
                                 const SurveyOptions& options,
                                 Duration scan_period);

/// Free positions near a walk: 0.5 to 1.5 m beside it, up to 0.5 m above or below, 0.3 m from
/// everything, level, with any heading. Throws InputError if there are not as many.
std::vector<Pose> places_near(const ExactScene& scene,
                              const SceneTree& tree,
                              const std::vector<TimedPose>& walk,
                              std::size_t count,
                              std::uint64_t seed);

}  // namespace pointflight
