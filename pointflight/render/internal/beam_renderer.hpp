#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "pointflight/render/internal/beam_kernel.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// One ray per beam through the map's hierarchy; a return is where the surfels hit within half a
/// voxel of depth cover at least the share tau of the beam (docs/architecture.md, "Hit rule").
///
/// Rays longer than `range_max` end there. Uses + - * / and sqrt only: the same bytes everywhere.
class BeamRenderer : public Renderer {
 public:
  explicit BeamRenderer(const Scene& scene, BeamGrouping grouping = BeamGrouping::kAutomatic);

  [[nodiscard]] Hit trace(const Ray& ray) const override;
  [[nodiscard]] Hit trace(const MapRay& ray) const;

  /// Beams whose list of surfels overflowed and lost its farthest entry: there the result may
  /// depend on the shape of the tree (never on threads).
  [[nodiscard]] std::uint64_t overflow_count() const { return overflows_; }

  [[nodiscard]] const KernelMap& kernel_map() const { return kernel_map_; }
  [[nodiscard]] Scene scene() const { return {map_}; }

  /// What a kernel found, with the map's intensity.
  [[nodiscard]] Hit hit_of(const KernelHit& found) const;

  /// True if wide beams are traced as cones.
  [[nodiscard]] static bool are_cones(const WideBeams& wide);
  /// Of a job of aimed cones, those that another device has left; and bodies in front of all.
  void finish_cones(const RenderJob& job,
                    std::span<const std::uint32_t> beams,
                    const Executor& executor) const;

 protected:
  [[nodiscard]] bool makes_rays() const override { return true; }
  void render_one(const RenderJob& job, const Executor& executor) const override;
  void render_wide(const RenderJob& job, const Executor& executor) const override;

 private:
  void hide_echoes(const RenderJob& job, const Executor& executor) const;
  void render_among_bodies(const RenderJob& job, const Executor& executor) const;
  void trace(const RenderJob& job, std::span<const MapRay> rays, const Executor& executor) const;

  std::shared_ptr<const SurfelMap> map_;
  KernelMap kernel_map_;
  BeamGrouping grouping_;
  mutable std::atomic<std::uint64_t> overflows_{0};
};

}  // namespace pointflight
