// A good map with any header and table of sections, whose checksum is right: an InputError, or a
// map that can be verified, drawn and searched for a way without an undefined conversion. The input
// is a list of edits: an offset and eight bytes.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "pointflight/core/hash.hpp"
#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/io/cloud_reader.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/picture/map_layers.hpp"
#include "pointflight/world/free_space.hpp"
#include "tests/fuzz/memory_cloud.hpp"
#include "tests/fuzz/one_line.hpp"

namespace {

using namespace pointflight;

std::vector<std::byte> good_map() {
  ShapeScene scene;
  scene.add_box({-3, -3, -1}, {3, 3, 2});
  std::vector<CloudPoint> points;
  scene.sample(100.0, 0.0, 1, [&](const Vector3d& p) { points.push_back({p, 10.0f}); });
  ImportOptions options;
  options.resolution = 0.4;
  const auto open = [&](std::size_t) { return std::make_unique<MemoryCloud>(points); };
  const ImportedMap map = build_map({"memory"}, open, options, Executor(1));
  return map_bytes(map.tree, map.description);
}

void ask(const SurfelMap& map, bool draws) {
  expect_one_line([&] { map.verify(); });
  static_cast<void>(map.hash());
  std::size_t count = 0;
  map.for_each_surfel([&](const Vector3d&, const Vector3d&, double, std::uint32_t) { ++count; });
  if (draws) {  // grids take a while
    const picture::MapLayers layers(map);
    static_cast<void>(layers.floor_at(map.bounds_world().min));
  }
  if (map.bounds_world().size().maxCoeff() > 20.0) return;  // a grid over all of it takes seconds
  TourOptions options;
  options.length_min = 2.0;
  const Vector3d corner = map.bounds_world().min;
  options.bounds = Aabb{corner, corner + Vector3d(2.0, 2.0, 2.0)};
  static_cast<void>(find_tour(map, options, Executor(1)));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<std::byte> good = good_map();
  constexpr std::size_t kChecksumAt = kMapHeaderSize - 8;
  constexpr std::size_t kEdit = 2 + 8;
  const bool draws = hash64(std::as_bytes(std::span(data, size))) % 32 == 0;
  std::vector<std::byte> bytes = good;
  for (; size >= kEdit; data += kEdit, size -= kEdit) {
    std::size_t offset = 0;
    std::memcpy(&offset, data, 2);
    std::memcpy(bytes.data() + offset % (kChecksumAt - 8), data + 2, 8);
  }
  const std::uint64_t checksum = hash64(std::span(bytes).first(kChecksumAt));
  std::memcpy(bytes.data() + kChecksumAt, &checksum, sizeof checksum);
  expect_one_line([&] { ask(*SurfelMap::from_bytes(bytes, "input"), draws); });
  return 0;
}
