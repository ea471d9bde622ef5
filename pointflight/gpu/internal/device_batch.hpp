#pragma once

#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "pointflight/gpu/internal/ray_tracer.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "pointflight/render/internal/expanded_job.hpp"

namespace pointflight {

/// Jobs of lines as a device takes them, in parts: aims of the same beams together, or rays one
/// after the other. Bodies are the processor's.
class DeviceBatch {
 public:
  /// `beam` traces what is too much for the kernel; of beams so many go in a part. What the jobs
  /// refer to, renderer and executor must outlive it; wide ones are left out.
  DeviceBatch(std::span<const RenderJob> jobs,
              const BeamRenderer& beam,
              std::size_t beams_at_once,
              const Executor& executor);
  DeviceBatch(const DeviceBatch&) = delete;  // parts refer to its jobs
  DeviceBatch& operator=(const DeviceBatch&) = delete;

  /// How many parts it has.
  [[nodiscard]] std::size_t parts() const { return parts_.size(); }
  /// The beams of a part; null: it is of rays.
  [[nodiscard]] const SensorBeams* beams_of(std::size_t part) const;
  /// Sends a part off. Throws GpuError.
  void send(std::size_t part, std::size_t slot, RayTracer& tracer) const;
  /// Writes what was hit, when it is no longer on its way.
  void take(std::size_t part, std::size_t slot, const RayTracer& tracer) const;
  /// The bodies, when all parts are taken.
  void finish() const;

 private:
  /// Rays of a job in some order, from the first on.
  struct RayPart {
    const RenderJob* job;
    std::span<const std::uint32_t> order;
  };
  /// Jobs one after the other, none of which needs a rays' order.
  struct AimPart {
    AimedPart aimed;
    std::vector<const RenderJob*> jobs;
  };
  using Part = std::variant<std::vector<RayPart>, AimPart>;

  void add_rays(const RenderJob& job);
  void add_aims(const RenderJob& job);
  void take(const std::vector<RayPart>& part, std::size_t slot, const RayTracer& tracer) const;
  void take(const AimPart& part, std::size_t slot, const RayTracer& tracer) const;
  void write(const RenderJob& job, std::size_t ray, const device::DeviceHit& hit) const;

  const BeamRenderer& beam_;
  std::size_t beams_at_once_;
  const Executor& executor_;
  std::vector<RenderJob> lines_;
  std::vector<std::unique_ptr<ExpandedJob>> among_bodies_;
  std::vector<std::vector<std::uint32_t>> orders_;  ///< Of jobs that bring none.
  std::vector<Part> parts_;
};

}  // namespace pointflight
