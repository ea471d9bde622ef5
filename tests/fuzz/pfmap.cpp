// Maps of any bytes: an InputError, or a map that can be asked anything without a read outside it.
//
// Most random bytes fail at the header's checksum, so an input whose first byte is even is taken as
// a list of edits (offset, value) of a good map, whose checksum is then made right.
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "pointflight/core/hash.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/map/edit/map_edit.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/render/renderer.hpp"
#include "pointflight/world/contact.hpp"
#include "tests/fuzz/memory_cloud.hpp"

namespace {

using namespace pointflight;

std::vector<std::byte> good_map() {
  ShapeScene scene;
  scene.add_box({-2, -2, -1}, {2, 2, 1});
  scene.shapes.emplace_back(SceneSphere{{1, 0, 0}, 0.3});
  std::vector<CloudPoint> points;
  scene.sample(400.0, 0.005, 1, [&](const Vector3d& p) {
    points.push_back({p, static_cast<float>(p.z())});
  });
  ImportOptions options;
  options.resolution = 0.2;
  const auto open = [&](std::size_t) { return std::make_unique<MemoryCloud>(points); };
  ImportedMap map = build_map({"memory"}, open, options, Executor(1));
  KnownSpaceBuilder known(map.description.bounds_world, map.description.resolution, 20000);
  known.cross({-1.5, -1.5, 0.5}, Vector3d(1, 1, -0.2).normalized(), 3.0);
  map.description.extra = {{KnownSpace::kSection, known.section()}};
  set_reflectivity(map.description, 0.01);
  return map_bytes(map.tree, map.description);
}

std::vector<std::byte> edited(std::vector<std::byte> bytes,
                              const std::uint8_t* data,
                              std::size_t size) {
  constexpr std::size_t kEdit = 3 + 4;
  for (; size >= kEdit; data += kEdit, size -= kEdit) {
    std::size_t offset = 0;
    std::memcpy(&offset, data, 3);
    std::memcpy(bytes.data() + offset % (bytes.size() - 3), data + 3, 4);
  }
  constexpr std::size_t kChecksumAt = kMapHeaderSize - 8;
  const std::uint64_t checksum = hash64(std::span(bytes).first(kChecksumAt));
  std::memcpy(bytes.data() + kChecksumAt, &checksum, sizeof checksum);
  return bytes;
}

class Blind : public EchoReceiver {
 public:
  [[nodiscard]] double reflectivity(const Hit& /*hit*/) const override { return 0.3; }
  [[nodiscard]] Reflectances reflectances() const override { return {.same = 0.3f}; }
  [[nodiscard]] bool is_marginal(const Echo& /*e*/, double /*l*/, double /*m*/) const override {
    return true;
  }
  [[nodiscard]] bool takes_strongest() const override { return false; }
};

void ask_everything(const SurfelMap& map, const std::shared_ptr<const SurfelMap>& shared) {
  std::vector<Ray> rays;
  for (int i = 0; i < 24; ++i) {
    const Vector3f direction(static_cast<float>(i % 3 - 1),
                             static_cast<float>(i % 5 - 2),
                             static_cast<float>(i % 7 - 3) + 0.1f);
    rays.push_back({Vector3d(0.3, 0.1 * i, 0.0), direction.normalized(), 30.0f});
  }
  RayBatch batch;
  batch.rays = rays;
  batch.range_max = 30.0f;
  std::vector<Hit> hits(rays.size());
  const auto renderer = make_renderer("beam", Scene{shared});
  renderer->render(batch, hits, Executor(1));
  const Blind receiver;
  std::vector<Echoes> echoes(rays.size());
  const std::vector<Vector3f> across(rays.size(), Vector3f::UnitY());
  const RenderJob wide{batch,
                       {},
                       WideBeams{.across = across,
                                 .sigma_across = 0.01f,
                                 .sigma_up = 0.01f,
                                 .merge = 0.5f,
                                 .sub_rays = 0,
                                 .receiver = &receiver,
                                 .echoes = echoes}};
  renderer->render({&wide, 1}, Executor(1));
  std::size_t surfels = map.reflectivity_per_intensity() > 0.0 ? 1 : 0;
  for (const Ray& ray : rays) surfels += map.nearest(ray.origin_world, 3.0) ? 1 : 0;
  const Solid box = Box{{0.3, 0.2, 0.1}};
  const Pose turned{Quaterniond(0.8, 0.1, 0.5, 0.3).normalized(), {0.2, 0.1, 0.3}};
  surfels += contact_with_map(map, box, turned, 2.0) ? 1 : 0;
  if (const KnownSpace* known = map.known_space()) {
    for (const Ray& ray : rays) {
      surfels += known->known(ray.origin_world) ? 1 : 0;
      surfels += known->known_along(ray.origin_world, ray.direction_world.cast<double>(), 30.0) > 1;
    }
  }
  map.for_each_surfel([&](const Vector3d&, const Vector3d&, double, std::uint32_t) { ++surfels; });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<std::byte> good = good_map();
  if (size == 0) return 0;
  const bool edit = data[0] % 2 == 0;
  const auto raw = std::as_bytes(std::span(data + 1, size - 1));
  const std::vector<std::byte> bytes =
      edit ? edited(good, data + 1, size - 1) : std::vector<std::byte>(raw.begin(), raw.end());
  try {
    const auto map = SurfelMap::from_bytes(bytes, "input");
    ask_everything(*map, map);
    map->verify();
  } catch (const InputError&) {
    return 0;
  }
  return 0;
}
