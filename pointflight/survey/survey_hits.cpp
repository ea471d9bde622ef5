#include "pointflight/survey/survey_hits.hpp"

#include <atomic>
#include <memory>
#include <span>
#include <vector>

#include "pointflight/render/internal/direction_order.hpp"

namespace pointflight {

std::uint64_t follow_survey(const SurfelMap& map,
                            const SurveyOpener& survey,
                            double right,
                            const Executor& executor,
                            const std::string& stage,
                            const Progress& progress,
                            const std::function<void(const SurveyRay&, const RayHits&)>& visit) {
  constexpr std::size_t kChunk = 1024;
  const KernelMap kernel = kernel_map_of(map);
  const float behind = static_cast<float>(right) + kernel.window;
  const auto reader = survey();
  std::vector<SurveyRay> batch;
  std::vector<MapRay> rays;
  std::atomic<std::uint64_t> overflows{0};
  while (reader->read(batch)) {
    report(progress, stage, reader->share_read());
    rays.clear();
    for (const SurveyRay& ray : batch) {
      rays.push_back(map_ray(
          kernel,
          {ray.origin_world, ray.direction_world, ray.is_return ? ray.range + behind : ray.range}));
    }
    const auto order = direction_order(rays, executor);
    executor.parallel_for(order.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      overflows += find_all_hits(
          kernel, rays, std::span(order).subspan(begin, end - begin), [&](const auto& way) {
            visit(batch[way.ray], way);
          });
    });
  }
  return overflows;
}

}  // namespace pointflight
