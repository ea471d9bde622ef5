#include "pointflight/gpu/gpu_renderer.hpp"

#include <fmt/format.h>

#include <atomic>
#include <optional>
#include <utility>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/gpu/internal/device_queue.hpp"
#include "pointflight/gpu/internal/exact_gpu.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "pointflight/render/internal/job_check.hpp"

namespace pointflight {
namespace {

std::unique_ptr<DeviceQueue> open_queue(const SurfelMap& map) {
  return open_on_gpu("beam", [&](ExactGpu gpu) {
    return std::make_unique<DeviceQueue>(std::move(gpu.device), map, gpu.kernel);
  });
}

/// Lines and cones on the device; bodies, sub-rays in given numbers and single rays by `beam` on
/// the processor, whose bits all have.
class GpuRenderer : public Renderer {
 public:
  /// Batches of fewer rays for each thread are the processor's.
  GpuRenderer(const Scene& scene, std::size_t fewest_rays)
      : beam_(scene), queue_(open_queue(*scene.map)), fewest_rays_(fewest_rays) {}

  [[nodiscard]] std::unique_ptr<Rendering> submit(std::span<const RenderJob> jobs,
                                                  const Executor& executor) const override {
    std::size_t beams = 0;
    for (const RenderJob& job : jobs) {
      require_valid(job);
      if (DeviceBatch::takes(job)) beams += job.batch.size();
    }
    const auto threads = static_cast<std::size_t>(executor.threads());
    const bool is_for_device = beams > 0 && beams >= fewest_rays_ * threads;
    if (is_lost_ || !is_for_device) return beam_.submit(jobs, executor);
    return std::make_unique<OnDevice>(*this, jobs, executor);
  }

  [[nodiscard]] Hit trace(const Ray& ray) const override { return beam_.trace(ray); }

  [[nodiscard]] std::size_t jobs_at_once() const override { return is_lost_ ? 0 : kJobsAtOnce; }

 protected:
  void render_one(const RenderJob& job, const Executor& executor) const override {
    submit({&job, 1}, executor)->collect();
  }

 private:
  /// Scans: their hits take up to some 100 MB.
  static constexpr std::size_t kJobsAtOnce = 32;

  /// Jobs of which some are the device's.
  class OnDevice : public Rendering {
   public:
    OnDevice(const GpuRenderer& own, std::span<const RenderJob> jobs, const Executor& executor)
        : own_(own),
          executor_(executor),
          batch_(jobs, own.beam_, own.queue_->at_once(), executor),
          ticket_{&batch_} {
      std::vector<RenderJob> others;
      for (const RenderJob& job : jobs) {
        (DeviceBatch::takes(job) ? taken_ : others).push_back(job);
      }
      try {
        own.queue_->start(ticket_);
      } catch (const GpuError& error) {
        own.lose(error);
      }
      own.beam_.render(others, executor);  // meanwhile
    }
    ~OnDevice() override { own_.queue_->forget(ticket_); }
    OnDevice(const OnDevice&) = delete;
    OnDevice& operator=(const OnDevice&) = delete;

    void collect() override {
      try {
        own_.queue_->finish(ticket_);
        batch_.finish();
      } catch (const GpuError& error) {
        own_.lose(error);
        own_.beam_.render(taken_, executor_);
      }
    }

   private:
    const GpuRenderer& own_;
    const Executor& executor_;
    std::vector<RenderJob> taken_;
    DeviceBatch batch_;
    DeviceQueue::Ticket ticket_;
  };

  void lose(const GpuError& error) const {
    if (is_lost_.exchange(true)) return;
    add_gpu_notice(
        fmt::format("{}: from here on the processor renders, to the same bits", error.what()));
  }

  BeamRenderer beam_;
  std::unique_ptr<DeviceQueue> queue_;
  std::size_t fewest_rays_;
  mutable std::atomic<bool> is_lost_ = false;
};

/// Rays for each thread of the processor's that a device is worth asking for: it answers after
/// 0.2 ms, in which a thread traces about so many.
constexpr std::size_t kWorthADevice = 512;

}  // namespace

std::unique_ptr<Renderer> make_gpu_renderer(const Scene& scene) {
  return std::make_unique<GpuRenderer>(scene, 0);
}

std::unique_ptr<Renderer> make_automatic_renderer(const Scene& scene) {
  std::optional<GpuInfo> info;
  try {
    info = find_gpu(chosen_gpu().index_or_name);
  } catch (const InputError&) {  // NOLINT(bugprone-empty-catch): without one it is the processor
  }
  if (!info || info->is_processor) return std::make_unique<BeamRenderer>(scene);
  try {
    return std::make_unique<GpuRenderer>(scene, kWorthADevice);
  } catch (const InputError& error) {
    add_gpu_notice(fmt::format("renderer auto: the processor renders ({})", error.what()));
    return std::make_unique<BeamRenderer>(scene);
  }
}

}  // namespace pointflight
