#pragma once

#include <memory>
#include <mutex>
#include <span>
#include <variant>
#include <vector>

#include "pointflight/gpu/internal/ray_tracer.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "pointflight/render/internal/expanded_job.hpp"

namespace pointflight {

/// Jobs as a device takes them, in parts: aims of the same beams together, as lines or wide, or
/// rays one after the other. Bodies are the processor's.
class DeviceBatch {
 public:
  /// How many beams go in a part.
  struct AtOnce {
    std::size_t lines;
    std::size_t wide;
  };

  /// `beam` traces what is too much for the kernels. What the jobs refer to, renderer and executor
  /// must outlive it; those that it does not take are left out.
  DeviceBatch(std::span<const RenderJob> jobs,
              const BeamRenderer& beam,
              const AtOnce& at_once,
              const Executor& executor);
  /// True of jobs for a device.
  [[nodiscard]] static bool takes(const RenderJob& job);
  DeviceBatch(const DeviceBatch&) = delete;  // parts refer to its jobs
  DeviceBatch& operator=(const DeviceBatch&) = delete;

  /// How many parts it has.
  [[nodiscard]] std::size_t parts() const { return parts_.size(); }
  /// The beams of a part; null: it is of rays.
  [[nodiscard]] const SensorBeams* beams_of(std::size_t part) const;
  /// Sends a part off. Throws GpuError.
  void send(std::size_t part, std::size_t slot, RayTracer& tracer) const;
  /// Writes what was hit, when it is no longer on its way.
  void take(std::size_t part, std::size_t slot, const RayTracer& tracer);
  /// What the device left, and bodies, when all parts are taken.
  void finish();

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
  /// A job of wide beams, and the beams that the device leaves.
  struct WideJob {
    explicit WideJob(const RenderJob& own) : job(own) {}
    RenderJob job;
    std::vector<std::uint32_t> left;
    std::mutex mutex;  ///< Of `left`.
  };
  struct WideAimPart {
    WidePart wide;
    std::vector<WideJob*> jobs;
  };
  using Part = std::variant<std::vector<RayPart>, AimPart, WideAimPart>;

  void add_rays(const RenderJob& job);
  void add_aims(const RenderJob& job);
  void add_wide(const RenderJob& job);
  void take(const std::vector<RayPart>& part, std::size_t slot, const RayTracer& tracer) const;
  void take(const AimPart& part, std::size_t slot, const RayTracer& tracer) const;
  void take(const WideAimPart& part, std::size_t slot, const RayTracer& tracer) const;
  bool write_wide(const RenderJob& job,
                  std::size_t beam,
                  const device::WideResult& result,
                  std::size_t slot,
                  const RayTracer& tracer) const;
  void write(const RenderJob& job, std::size_t ray, const device::DeviceHit& hit) const;

  const BeamRenderer& beam_;
  AtOnce at_once_;
  const Executor& executor_;
  std::vector<RenderJob> lines_;
  std::vector<std::unique_ptr<WideJob>> wide_;
  std::vector<std::unique_ptr<ExpandedJob>> among_bodies_;
  std::vector<std::vector<std::uint32_t>> orders_;  ///< Of jobs that bring none.
  std::vector<Part> parts_;
};

}  // namespace pointflight
