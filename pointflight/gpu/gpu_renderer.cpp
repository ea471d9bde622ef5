#include "pointflight/gpu/gpu_renderer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "pointflight/core/cpu_account.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/gpu/internal/kernel_choice.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "pointflight/render/internal/body_renderer.hpp"
#include "pointflight/render/internal/direction_order.hpp"
#include "pointflight/render/internal/job_check.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kPackChunk = 4096;  // rays

/// What `take_gpu_notices` gives, by any thread.
struct Notices {
  std::mutex mutex;
  std::vector<std::string> all;
};
Notices& notices() {
  static Notices own;
  return own;
}

/// A device with a map, for one batch at a time.
struct Engine {
  Engine(std::shared_ptr<GpuDevice> opened, const SurfelMap& surfels, const RayKernel& kernel)
      : device(std::move(opened)), map(*device, surfels), tracer(*device, map, kernel) {}

  std::shared_ptr<GpuDevice> device;
  DeviceMap map;
  RayTracer tracer;
  std::mutex mutex;  ///< Of the tracer.
};

/// Rays of jobs one after the other, each job's in its order.
class Line {
 public:
  Line(std::span<const RenderJob> jobs, const Executor& executor) : jobs_(jobs) {
    orders_.resize(jobs.size());
    for (const RenderJob& job : jobs) {
      const std::size_t k = begins_.size();
      begins_.push_back(size_);
      if (job.wide) continue;
      size_ += job.batch.rays.size();
      if (job.batch.order.size() != job.batch.rays.size()) {
        orders_[k] = direction_order(job.batch.rays, executor);
      }
    }
  }

  [[nodiscard]] std::size_t size() const { return size_; }

  /// Calls `action(job, order, at)` for the parts of jobs that lie in [begin, end); `at`: of the
  /// part's first ray, from `begin`.
  template <class Action>
  void for_parts(std::size_t begin, std::size_t end, const Action& action) const {
    auto k = static_cast<std::size_t>(std::upper_bound(begins_.begin(), begins_.end(), begin) -
                                      begins_.begin() - 1);
    for (std::size_t at = begin; at < end; ++k) {
      const RenderJob& job = jobs_[k];
      if (job.wide || job.batch.rays.empty()) continue;
      const std::size_t from = at - begins_[k];
      const std::size_t count = std::min(end - at, job.batch.rays.size() - from);
      const std::span<const std::uint32_t> order =
          orders_[k].empty() ? job.batch.order : std::span<const std::uint32_t>(orders_[k]);
      const ChargeTo charge(job.account != nullptr ? job.account : ChargeTo::current());
      action(job, order.subspan(from, count), at - begin);
      at += count;
    }
  }

 private:
  std::span<const RenderJob> jobs_;
  std::vector<std::vector<std::uint32_t>> orders_;  ///< Of jobs that bring none.
  std::vector<std::size_t> begins_;
  std::size_t size_ = 0;
};

/// Lines on the device; wide beams, bodies and single rays by `beam` on the processor, whose bits
/// all have.
class GpuRenderer : public Renderer {
 public:
  explicit GpuRenderer(const Scene& scene) : map_(scene.map), beam_(scene) {
    const GpuInfo info = find_gpu(chosen_gpu());
    try {
      auto device = GpuDevice::open(info);
      const std::optional<RayKernel> kernel = exact_kernel(*device);
      if (!kernel) {
        throw InputError(fmt::format(
            "{} does not come to this processor's bits by any way of dividing; use --renderer beam",
            info.name));
      }
      engine_ = std::make_unique<Engine>(std::move(device), *map_, *kernel);
    } catch (const GpuError& error) {
      throw InputError(fmt::format("{}; use --renderer beam", error.what()));
    }
  }

  [[nodiscard]] std::unique_ptr<Rendering> submit(std::span<const RenderJob> jobs,
                                                  const Executor& executor) const override {
    for (const RenderJob& job : jobs) require_valid(job);
    if (is_lost_) return beam_.submit(jobs, executor);
    std::vector<RenderJob> wide;
    for (const RenderJob& job : jobs) {
      if (job.wide) wide.push_back(job);
    }
    try {
      trace_lines(jobs, executor);
    } catch (const GpuError& error) {
      if (!is_lost_.exchange(true)) {
        const std::lock_guard lock(notices().mutex);
        notices().all.push_back(
            fmt::format("{}: from here on the processor renders, to the same bits", error.what()));
      }
      return beam_.submit(jobs, executor);
    }
    return beam_.submit(wide, executor);
  }

  [[nodiscard]] Hit trace(const Ray& ray) const override { return beam_.trace(ray); }

 protected:
  void render_one(const RenderJob& job, const Executor& executor) const override {
    submit({&job, 1}, executor)->collect();
  }

 private:
  void trace_lines(std::span<const RenderJob> jobs, const Executor& executor) const {
    const Line line(jobs, executor);
    if (line.size() == 0) return;
    constexpr std::size_t kSlots = RayTracer::kSlots;
    constexpr std::size_t kMost = RayTracer::kMostRays;
    const std::lock_guard lock(engine_->mutex);
    RayTracer& tracer = engine_->tracer;
    const std::size_t parts = (line.size() + kMost - 1) / kMost;
    const auto count_of = [&](std::size_t part) {
      return std::min(kMost, line.size() - part * kMost);
    };
    // while the device traces one part the host packs the next and unpacks the one before
    for (std::size_t part = 0; part < parts + kSlots - 1; ++part) {
      if (part < parts) {
        pack(line, part * kMost, tracer.rays(part % kSlots, count_of(part)), executor);
        tracer.submit(part % kSlots, count_of(part));
      }
      if (part + 1 < kSlots) continue;
      const std::size_t done = part + 1 - kSlots;
      if (done >= parts) continue;
      unpack(line, done * kMost, tracer.collect(done % kSlots), executor);
    }
    for (const RenderJob& job : jobs) {
      if (job.wide || job.batch.bodies.empty()) continue;
      const ChargeTo charge(job.account != nullptr ? job.account : ChargeTo::current());
      render_bodies(job.batch, job.hits, executor);
    }
  }

  /// Calls `action(job, order, at)` for `count` rays from `first` on, by all threads; `at`: of the
  /// first ray of `order` among them.
  template <class Action>
  static void for_rays(const Line& line,
                       std::size_t first,
                       std::size_t count,
                       const Executor& executor,
                       const Action& action) {
    executor.parallel_for(count, kPackChunk, [&](std::size_t begin, std::size_t end) {
      line.for_parts(
          first + begin,
          first + end,
          [&](const RenderJob& job, std::span<const std::uint32_t> order, std::size_t at) {
            action(job, order, begin + at);
          });
    });
  }

  void pack(const Line& line,
            std::size_t first,
            std::span<device::DeviceRay> packed,
            const Executor& executor) const {
    for_rays(line,
             first,
             packed.size(),
             executor,
             [&](const RenderJob& job, std::span<const std::uint32_t> order, std::size_t at) {
               pack_rays(*map_, job.batch.rays, order, packed.subspan(at, order.size()));
             });
  }

  void unpack(const Line& line,
              std::size_t first,
              std::span<const device::DeviceHit> found,
              const Executor& executor) const {
    for_rays(line,
             first,
             found.size(),
             executor,
             [&](const RenderJob& job, std::span<const std::uint32_t> order, std::size_t at) {
               for (std::size_t i = 0; i < order.size(); ++i) {
                 const device::DeviceHit& hit = found[at + i];
                 job.hits[order[i]] = hit.range == device::kTooMany
                                          ? beam_.trace(job.batch.rays[order[i]])
                                          : beam_.hit_of({hit.range, hit.cosine, hit.surfel});
               }
             });
  }

  std::shared_ptr<const SurfelMap> map_;
  BeamRenderer beam_;
  std::unique_ptr<Engine> engine_;
  mutable std::atomic<bool> is_lost_ = false;
};

}  // namespace

std::unique_ptr<Renderer> make_gpu_renderer(const Scene& scene) {
  return std::make_unique<GpuRenderer>(scene);
}

std::vector<std::string> take_gpu_notices() {
  const std::lock_guard lock(notices().mutex);
  return std::exchange(notices().all, {});
}

}  // namespace pointflight
