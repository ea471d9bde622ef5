#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "pointflight/render/internal/paper_painter.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

struct PaperOptions {
  double voxel_length = 2.0;      ///< l: edge of the screening voxels, m.
  double gamma_threshold = 0.06;  ///< Planes thinner than this share of r are corrected.
};

/// The renderer of the MARSIM paper, section IV.A: map points in voxels that intersect the field of
/// view are projected into a depth image of angular resolution theta_res (azimuth by elevation,
/// laid over the rays of the batch); each fills the pixels within theta_max = asin(sqrt(3)/2 r / d)
/// (eq. 1), a point on a plane with the depth at which the pixel's ray hits that plane; pixels keep
/// the smallest depth. A ray returns the depth of its pixel. r is that of the cell that a surfel
/// stands for: half the map's for small ones, more for wide ones.
///
/// All rays start at the sensor's pose, as in the paper: no rolling scan. Bodies are drawn as
/// points of their surfaces, about r apart, where they are at that instant (the paper, section
/// IV.E).
class PaperRenderer : public Renderer {
 public:
  /// Makes what paints images with these voxels' points, which stay where they are.
  using MakePainter =
      std::function<std::unique_ptr<PaperPainter>(std::span<const PaperVoxel> voxels)>;

  /// Without `make_painter` the processor paints.
  PaperRenderer(const Scene& scene,
                const PaperOptions& options,
                const MakePainter& make_painter = nullptr);

  [[nodiscard]] bool is_snapshot() const override { return true; }

 protected:
  void render_one(const RenderJob& job, const Executor& executor) const override;

 private:
  /// What is drawn of a body at an instant, in its own frame.
  [[nodiscard]] PaperPoints points_of(const Body& body, SimTime time) const;
  /// The batch's bodies in an image of their own, whose intensities are their numbers.
  void draw_bodies(const RayBatch& batch, const Pose& T_sensor_world, PaperImage& image) const;

  std::shared_ptr<const SurfelMap> map_;
  PaperOptions options_;
  std::vector<PaperVoxel> voxels_;
  std::unique_ptr<PaperPainter> painter_;
  double largest_radius_ = 0.0;  ///< Of the points, m.
};

}  // namespace pointflight
