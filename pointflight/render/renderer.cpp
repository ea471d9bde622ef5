#include "pointflight/render/renderer.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pointflight/core/input_error.hpp"
#include "pointflight/render/beam_renderer.hpp"
#include "pointflight/render/paper_renderer.hpp"

namespace pointflight {
namespace {

struct Entry {
  const char* name;
  std::unique_ptr<Renderer> (*make)(const Scene& scene);
};

constexpr Entry kRenderers[] = {
    {"beam",
     [](const Scene& scene) -> std::unique_ptr<Renderer> {
       return std::make_unique<BeamRenderer>(scene);
     }},
    {"paper",
     [](const Scene& scene) -> std::unique_ptr<Renderer> {
       return std::make_unique<PaperRenderer>(scene, PaperOptions{});
     }},
};

}  // namespace

Hit Renderer::trace(const Ray& ray) const {
  RayBatch batch;
  batch.rays = {&ray, 1};
  batch.T_world_sensor.translation = ray.origin_world;
  batch.range_max = ray.range_max;
  Hit hit;
  render(batch, {&hit, 1}, Executor(1));
  return hit;
}

std::vector<std::string> renderer_names() {
  std::vector<std::string> names;
  for (const Entry& entry : kRenderers) names.emplace_back(entry.name);
  return names;
}

std::unique_ptr<Renderer> make_renderer(const std::string& name, const Scene& scene) {
  for (const Entry& entry : kRenderers) {
    if (name == entry.name) return entry.make(scene);
  }
  throw InputError(
      fmt::format("renderer '{}' is unknown; one of: {}", name, fmt::join(renderer_names(), ", ")));
}

}  // namespace pointflight
