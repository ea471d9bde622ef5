#include "pointflight/render/renderer.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>
#include <variant>

#include "pointflight/core/argument.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "pointflight/render/internal/direction_order.hpp"
#include "pointflight/render/internal/expanded_job.hpp"
#include "pointflight/render/internal/job_check.hpp"
#include "pointflight/render/internal/paper_renderer.hpp"
#include "pointflight/render/internal/see_through_renderer.hpp"
#include "pointflight/render/internal/sub_ray_renderer.hpp"

namespace pointflight {
namespace {

/// All is there already.
class Rendered : public Rendering {
 public:
  void collect() override {}
};

}  // namespace

void require_valid(const RenderJob& job) {
  const RayBatch& batch = job.batch;
  const std::size_t count = batch.size();
  require_argument(batch.aimed == nullptr || batch.rays.empty(),
                   "render: rays are wanted or beams, not both");
  if (job.wide) {
    const std::size_t across = job.wide->across.size();
    require_argument((across == count || (across == 0 && batch.aimed != nullptr)) &&
                         job.wide->echoes.size() == count && job.wide->receiver != nullptr,
                     "render: of wide beams a direction across each, as many echoes and a receiver "
                     "are wanted");
  } else {
    require_argument(
        job.hits.size() + job.ranges.size() == count && (job.hits.empty() || job.ranges.empty()),
        "render: as many hits or ranges as rays are wanted");
  }
  require_argument(batch.order.empty() || batch.order.size() == count,
                   "render: an order of all rays is wanted, or none");
  require_argument(batch.time_offsets.empty() || batch.time_offsets.size() == count,
                   "render: a time offset for each ray is wanted, or none");
  const Pose& pose = batch.T_world_sensor;
  require_argument(pose.translation.allFinite() && pose.rotation.coeffs().allFinite() &&
                       batch.image_resolution > 0.0,
                   "render: a finite pose and an image resolution above 0 are wanted");
  for (const Body& body : batch.bodies) {
    const auto* cloud = std::get_if<std::shared_ptr<const SurfelMap>>(&body.shape);
    require_argument(cloud == nullptr || *cloud != nullptr,
                     "render: a body wants a shape and a pose as a function of time");
  }
  assert(std::all_of(batch.rays.begin(), batch.rays.end(), [](const Ray& ray) {
    return ray.origin_world.allFinite() && ray.direction_world.allFinite() &&
           !std::isnan(ray.range_max);
  }));
}

Registry<RendererKind>& RendererKind::table() {
  static Registry<RendererKind> table = {
      {.name = "beam",
       .help = "each ray by itself, through surfels",
       .make = [](const Scene& scene) { return std::make_unique<BeamRenderer>(scene); },
       .one_pose = false},
      {.name = "paper",
       .help = "the MARSIM paper's image of points",
       .make =
           [](const Scene& scene) {
             return std::make_unique<PaperRenderer>(scene, PaperOptions{});
           },
       .one_pose = true}};
  return table;
}

void Renderer::render(std::span<const RenderJob> jobs, const Executor& executor) const {
  submit(jobs, executor)->collect();
}

void Renderer::render(const RayBatch& batch, std::span<Hit> hits, const Executor& executor) const {
  const RenderJob job{batch, hits, std::nullopt};
  render({&job, 1}, executor);
}

std::unique_ptr<Rendering> Renderer::submit(std::span<const RenderJob> jobs,
                                            const Executor& executor) const {
  for (const RenderJob& job : jobs) require_valid(job);
  executor.parallel_for(jobs.size(), 1, [&](std::size_t k, std::size_t) {
    CpuAccount* const account = jobs[k].account;
    const ChargeTo charge(account != nullptr ? account : ChargeTo::current());
    const auto render_job = [&](const RenderJob& job) {
      if (job.wide) {
        render_wide(job, executor);
      } else {
        render_one(job, executor);
      }
    };
    if (makes_rays() || (jobs[k].batch.aimed == nullptr && jobs[k].ranges.empty())) {
      render_job(jobs[k]);
      return;
    }
    const ExpandedJob expanded(jobs[k], executor);
    render_job(expanded.job());
    expanded.finish();
  });
  return std::make_unique<Rendered>();
}

void Renderer::render_wide(const RenderJob& job, const Executor& executor) const {
  std::vector<std::uint32_t> beams(job.batch.order.begin(), job.batch.order.end());
  if (beams.size() != job.batch.rays.size()) beams = direction_order(job.batch.rays, executor);
  const std::size_t count = job.wide->sub_rays > 0 ? job.wide->sub_rays : kUsualSubRays;
  const auto render_lines = [&](const RenderJob& lines) { render_one(lines, executor); };
  find_echoes(job, beams, count, render_lines, executor);
}

Hit Renderer::trace(const Ray& ray) const {
  RayBatch batch;
  batch.rays = {&ray, 1};
  batch.T_world_sensor.translation = ray.origin_world;
  batch.range_max = ray.range_max;
  Hit hit;
  render(batch, {&hit, 1}, Executor(1));
  return hit;
}

std::unique_ptr<Renderer> make_renderer(const RendererKind& kind, const Scene& scene) {
  std::unique_ptr<Renderer> made = kind.make(scene);  // which refuses a scene without a map
  if (!scene.map->notes().has_opacity()) return made;
  return std::make_unique<SeeThroughRenderer>(std::move(made), scene);
}

std::unique_ptr<Renderer> make_renderer(const std::string& name, const Scene& scene) {
  return make_renderer(*Choice<RendererKind>(name), scene);
}

}  // namespace pointflight
