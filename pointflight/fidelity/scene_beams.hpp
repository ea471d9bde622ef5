#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/fidelity/error_statistics.hpp"
#include "pointflight/render/renderer.hpp"
#include "pointflight/scenes/exact_scene.hpp"

namespace pointflight {

/// Which beams look at a scene.
struct BeamPlan {
  std::string name;  ///< For reports.
  /// Unit vectors in the sensor frame; empty: aimed at the scene's targets, or all around.
  std::vector<Vector3f> directions_sensor;
  float range_max = 40.0f;          ///< m
  std::vector<Pose> places;         ///< T_world_sensor; empty: the scene's own.
  std::size_t poses = 8;            ///< Random ones if the scene has none of its own.
  std::size_t aimed_beams = 20000;  ///< A pose, without directions.
  std::uint64_t seed = 1;           ///< Of poses and aimed directions.
};

/// The patterns that the scenes' tables were measured with: "avia_grid" (385 x 350 over 77 x 70
/// degrees, 30 m), "mid360_uniform" (20,000 at random, -7 to 52 degrees, 40 m), "vlp32_grid"
/// (1,800 x 32, -25 to 15 degrees, 100 m). Nothing for another name.
std::optional<BeamPlan> table_beams(const std::string& name);

/// A beam and what it hits in truth.
struct TrueBeam {
  Ray ray;                     ///< World; ends at the plan's range_max.
  float range = -1.0f;         ///< m; negative if it hits nothing within its range.
  float range_beside = -1.0f;  ///< m; what a beam 0.1 degrees beside it hits; negative: nothing.
  float cos_incidence = 0.0f;  ///< |cos| of the angle to the surface normal.
  Vector3f normal_world = Vector3f::Zero();  ///< Of the surface hit, towards the sensor.
  std::uint16_t tag = 0;                     ///< Of the shape hit.
  bool silhouette = false;                   ///< A range jump lies within 0.2 degrees.
};

/// All beams of a plan in a scene.
struct SceneBeams {
  BeamPlan plan;                ///< What they were cast by.
  std::vector<Pose> poses;      ///< T_world_sensor: the scene's own, or found at random.
  std::vector<TrueBeam> beams;  ///< Pose after pose, as many for each.

  /// Beams of each pose; 0 without poses.
  [[nodiscard]] std::size_t per_pose() const {
    return poses.empty() ? 0 : beams.size() / poses.size();
  }
};

/// Casts the beams into the exact shapes. A silhouette is where one of sixteen rays 0.1 and
/// 0.2 degrees around the beam ends more than 0.1 m off the plane that the beam hits. Throws
/// InputError if no free position for a sensor is found.
SceneBeams cast_exactly(const ExactScene& scene,
                        const BeamPlan& plan,
                        const Executor& executor,
                        const Progress& progress = {});

/// One class of beams.
struct FidelityRow {
  std::string name;            ///< The tag, or "30-60 deg", "5-10 m".
  ErrorStatistics statistics;  ///< Of its beams.
};

/// How rendered ranges compare with the exact ones.
struct FidelityReport {
  ErrorStatistics all;                    ///< All beams.
  ErrorStatistics interior;               ///< No range jump near.
  ErrorStatistics silhouette;             ///< The others.
  std::vector<FidelityRow> by_tag;        ///< Of each tag of the scene.
  std::vector<FidelityRow> by_incidence;  ///< 0 is face on.
  std::vector<FidelityRow> by_range;      ///< By the true range.
  std::vector<float> rendered;            ///< Of each beam, m; negative if nothing was hit.
};

/// Renders all beams, each pose as one batch, and sorts them into classes. Rays that hit nothing
/// in truth count as false returns if one is rendered, and are in none of the last three lists.
FidelityReport measure_fidelity(const ExactScene& scene,
                                const SceneBeams& beams,
                                const Renderer& renderer,
                                const Executor& executor);

}  // namespace pointflight
