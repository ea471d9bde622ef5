#include "pointflight/render/internal/map_ray.hpp"

#include <algorithm>
#include <array>

#include "pointflight/render/internal/aim_kernel.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kRaysPerPart = 2048;

/// The rays of some beams from `begin` on.
void make_map_rays(const MapPosition& from,
                   const AimedBeams& aimed,
                   std::size_t begin,
                   std::span<MapRay> made) {
  std::array<AimedBeam, 64> beams;  // NOLINT(cppcoreguidelines-pro-type-member-init): written
  for (std::size_t at = 0; at < made.size(); at += beams.size()) {
    const std::span some = std::span(beams).first(std::min(beams.size(), made.size() - at));
    aim_some(aimed, begin + at, some, false);
    for (std::size_t i = 0; i < some.size(); ++i) {
      MapRay& ray = made[at + i];
      for (int k = 0; k < 3; ++k) {
        ray.voxel[k] = from.axis[k].voxel;
        ray.rest[k] = from.axis[k].rest + some[i].shift[k];
        ray.direction[k] = some[i].direction[k];
      }
      ray.range_max = aimed.range_max * aimed.beams->beams[begin + at + i].stretch;
    }
  }
}

}  // namespace

MapRay map_ray(const KernelMap& map, const Ray& ray) {
  MapRay made;  // NOLINT(cppcoreguidelines-pro-type-member-init): written on the next lines
  for (int k = 0; k < 3; ++k) {
    const GridOrigin from = grid_origin(ray.origin_world[k] - map.origin[k], map.resolution);
    made.voxel[k] = from.voxel;
    made.rest[k] = from.rest;
    made.direction[k] = ray.direction_world[k];
  }
  made.range_max = ray.range_max;
  return made;
}

std::vector<MapRay> map_rays(const KernelMap& map, std::span<const Ray> rays) {
  std::vector<MapRay> made;
  made.reserve(rays.size());
  for (const Ray& ray : rays) made.push_back(map_ray(map, ray));
  return made;
}

MapPosition map_position(const KernelMap& map, const AimedBeams& aimed) {
  MapPosition position{};
  for (int k = 0; k < 3; ++k) {
    position.axis[k] = grid_origin(aimed.position_world[k] - map.origin[k], map.resolution);
  }
  return position;
}

MapRay map_ray(const KernelMap& map, const RayBatch& batch, std::size_t i) {
  if (batch.aimed == nullptr) return map_ray(map, batch.rays[i]);
  MapRay made;  // NOLINT(cppcoreguidelines-pro-type-member-init): written on the next line
  make_map_rays(map_position(map, *batch.aimed), *batch.aimed, i, {&made, 1});
  return made;
}

std::vector<MapRay> map_rays(const KernelMap& map,
                             const RayBatch& batch,
                             const Executor& executor) {
  std::vector<MapRay> made(batch.size());
  const MapPosition from = batch.aimed != nullptr ? map_position(map, *batch.aimed) : MapPosition{};
  executor.parallel_for(made.size(), kRaysPerPart, [&](std::size_t begin, std::size_t end) {
    if (batch.aimed != nullptr) {
      make_map_rays(from, *batch.aimed, begin, std::span(made).subspan(begin, end - begin));
      return;
    }
    for (std::size_t i = begin; i < end; ++i) made[i] = map_ray(map, batch.rays[i]);
  });
  return made;
}

}  // namespace pointflight
