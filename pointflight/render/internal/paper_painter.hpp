#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "pointflight/core/parallel.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/render/internal/paper_kernel.hpp"

namespace pointflight {

/// Points of the map in a cube of the screening grid.
struct PaperVoxel {
  Vector3d corner_world;
  PaperPoints points;  ///< From the corner.
};

/// Paints depth images of the `paper` renderer with the points of voxels. All painters come to the
/// same image, to the bit: a pixel keeps the nearest point, the first of several as near.
class PaperPainter {
 public:
  virtual ~PaperPainter() = default;
  /// The points of `seen` voxels, in ascending order, into an empty image.
  virtual void draw(std::span<const std::size_t> seen,
                    const Pose& T_sensor_world,
                    PaperImage& image,
                    const Executor& executor) const = 0;
};

/// One that paints on this processor; the voxels must outlive it.
std::unique_ptr<PaperPainter> make_processor_painter(std::span<const PaperVoxel> voxels);

}  // namespace pointflight
