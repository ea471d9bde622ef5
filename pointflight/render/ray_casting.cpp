#include "pointflight/render/ray_casting.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "pointflight/core/argument.hpp"
#include "pointflight/geometry/internal/grid_cells.hpp"
#include "pointflight/render/internal/direction_order.hpp"

namespace pointflight {
namespace {

constexpr double kCube = 0.5;      // m
constexpr std::size_t kMany = 64;  // rays from one position that are a batch of their own

/// What is rendered together: rays from one position, if there are many from each, else those that
/// start in one cube. The same number for all rays: they need no order of their own.
std::vector<std::uint64_t> groups_of(std::span<const Ray> rays) {
  std::vector<std::uint64_t> groups(rays.size(), 0);
  std::uint64_t position = 0;
  for (std::size_t i = 1; i < rays.size(); ++i) {
    if (rays[i].origin_world != rays[i - 1].origin_world) ++position;
    groups[i] = position;
  }
  if ((position + 1) * kMany <= rays.size()) return groups;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    groups[i] = grid_key(grid_cell(rays[i].origin_world, kCube));
  }
  return groups;
}

/// Group by group, by direction in each; empty if all are one.
std::vector<std::uint32_t> order_of_rays(std::span<const Ray> rays, const Executor& executor) {
  const std::vector<std::uint64_t> groups = groups_of(rays);
  const auto differs = [&](std::uint64_t group) { return group != groups.front(); };
  if (std::none_of(groups.begin(), groups.end(), differs)) return {};
  std::vector<std::uint32_t> order = direction_order(rays, executor);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return groups[a] < groups[b];
  });
  return order;
}

}  // namespace

void cast_rays(const Renderer& renderer,
               std::span<const Ray> rays,
               std::span<Hit> hits,
               const Executor& executor,
               std::span<const Body> bodies,
               SimTime time) {
  require_argument(!renderer.is_snapshot(), "cast_rays: a renderer of single rays is wanted");
  if (rays.empty()) return;
  const std::vector<std::uint32_t> order = order_of_rays(rays, executor);
  RayBatch batch;
  batch.rays = rays;
  batch.order = order;
  batch.T_world_sensor.translation = rays.front().origin_world;
  batch.range_max = 0.0f;
  batch.bodies = bodies;
  batch.time = time;
  batch.snapshot_time = time;
  for (const Ray& ray : rays) batch.range_max = std::max(batch.range_max, ray.range_max);
  renderer.render(batch, hits, executor);
}

}  // namespace pointflight
