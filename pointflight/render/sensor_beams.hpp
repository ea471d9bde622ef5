// Beams as a sensor fires them and the poses from which it does. Whoever traces them makes the rays
// of them, a processor or a GPU, to the same bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// One beam in the frame of its sensor (x forward, y left, z up). GPUs read it as it lies here.
struct SensorBeam {
  float direction[3];    ///< Unit vector.
  float origin[3];       ///< m
  float across[2];       ///< x and y of a horizontal unit vector across it (`horizontal_across`).
  float stretch;         ///< Its longest range in units of the scan's: not 1 of cameras.
  float fraction;        ///< When it fires, as a share of its piece of the scan, 0 to 1.
  std::uint32_t piece;   ///< Which piece of the scan that is.
  std::uint32_t number;  ///< Of the beam.
};

/// The horizontal of the sensor across a beam; its y axis of beams straight up or down.
[[nodiscard]] Vector3f horizontal_across(const Vector3f& direction_sensor);

/// The beams of a scan, in the order of firing: made once for all who have the same.
struct SensorBeams {
  std::vector<SensorBeam> beams;     ///< Of all.
  std::vector<std::uint32_t> order;  ///< `RayBatch::order`
  std::uint32_t pieces = 1;          ///< Equally long ones that the scan's time is divided into.
  bool has_origins = false;          ///< Not all beams leave from the sensor's origin.
};

/// How far a beam is turned away from where it should go, about two axes across it, rad.
struct BeamDeviation {
  float u = 0.0f;  ///< Towards `SensorBeam::across`.
  float v = 0.0f;  ///< Towards direction x across.
};

/// Where a sensor is.
struct BeamPose {
  float rotation[4];  ///< q_world_sensor, x y z w; neighbours have the nearer one of q and -q.
  float shift[3];     ///< From `AimedBeams::position_world`, m.
};

/// Beams in the world.
struct AimedBeams {
  std::shared_ptr<const SensorBeams> beams;    ///< Never null.
  Vector3d position_world = Vector3d::Zero();  ///< What shifts count from, m.
  std::vector<BeamPose> poses;                 ///< At the ends of all pieces, or one: of all beams.
  std::vector<BeamDeviation> deviations;       ///< Of each beam, or none.
  float range_max = 0.0f;                      ///< m, times `SensorBeam::stretch`.
};

/// Beams from one pose, or from those at the ends of all pieces, in order of time. Between two that
/// follow each other the sensor turns by less than 100 degrees. Positions that lie up to 10 m apart
/// come out right to a micrometre. Throws std::invalid_argument if there are neither one nor
/// `beams->pieces` + 1.
[[nodiscard]] AimedBeams aim_beams(std::shared_ptr<const SensorBeams> beams,
                                   std::span<const Pose> T_world_sensor,
                                   float range_max);

/// The rays of the beams from `begin` on.
void make_rays(const AimedBeams& aimed, std::size_t begin, std::span<Ray> rays);
/// `horizontal_across` in the world of the beams from `begin` on: as their poses have it, whatever
/// their deviations.
void make_across(const AimedBeams& aimed, std::size_t begin, std::span<Vector3f> across);

}  // namespace pointflight
