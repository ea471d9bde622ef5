// The file of a map: nearest surfels, damage.
#include "pointflight/map/map_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <functional>
#include <limits>
#include <utility>

#include "pointflight/core/hash.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/io/pcd_writer.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/map/import/spacing.hpp"
#include "tests/map/small_room.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::cloud_of;
using testing::error_of;
using testing::expect_contains;
using testing::import_points;
using testing::map_of;
using testing::small_room;
using testing::TemporaryFolder;

/// Distance to a surfel's box: the slow twin of SurfelMap::nearest.
double brute_force_distance(const SurfelMap& map, const Vector3d& p) {
  double best = 1e300;
  for (std::size_t at = 0; at + kLeafPadding < map.words().size();) {
    const LeafHeader leaf = decode_leaf(map.words()[at]);
    for (std::size_t i = 1; i <= leaf.count; ++i) {
      const Surfel s = decode(map.words()[at + i]);
      const Vector3d center =
          map.origin_world() +
          map.resolution() * (Vector3d(leaf.x, leaf.y, leaf.z) + s.center_voxels.cast<double>());
      const Vector3d local = s.axes.cast<double>().transpose() * (p - center);
      Vector3d outside;
      for (int k = 0; k < 3; ++k) {
        outside[k] = std::max(
            0.0,
            std::abs(local[k]) - std::sqrt(3.0) * static_cast<double>(s.s[k]) * map.resolution());
      }
      best = std::min(best, outside.norm());
    }
    at += leaf.count + 1;
  }
  return best;
}

TEST(Nearest, EqualsBruteForce) {
  const auto map = map_of(small_room(), 0.1, 8.0, 0.005);
  const RandomStream random(3, StreamId::kTest, 0);
  for (std::uint64_t i = 0; i < 300; ++i) {
    const Vector3d p(random.uniform(3 * i, -2, 8),
                     random.uniform(3 * i + 1, -2, 7),
                     random.uniform(3 * i + 2, -2, 5));
    const double truth = brute_force_distance(*map, p);
    const auto found = map->nearest(p, 100.0);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->distance, truth, 1e-4) << p.transpose();
    EXPECT_FALSE(map->nearest(p, truth - 1e-3));
  }
}

TEST(MapFile, OpensFromDiskAndVerifies) {
  const TemporaryFolder folder;
  ImportOptions options;
  options.resolution = 0.1;
  const ImportedMap imported = import_points(cloud_of(small_room(), 800.0), options);
  write_map(OutputFile(folder / "a.pfmap"), imported.tree, imported.description);
  const auto map = SurfelMap::open(folder / "a.pfmap");
  map->verify();
  EXPECT_EQ(map->surfel_count(), imported.report.surfels);
  EXPECT_EQ(map->resolution(), 0.1);
  expect_contains(std::string(map->metadata()), "\"sources\"");
  EXPECT_LT(static_cast<double>(map->file_size()) / static_cast<double>(map->surfel_count()), 16.0);
}

TEST(MapFile, LeavesAtTheEndOf32BitsAreNotRead) {
  ImportOptions options;
  options.resolution = 0.2;
  const ImportedMap imported = import_points(cloud_of(small_room(), 800.0), options);
  auto bytes = map_bytes(imported.tree, imported.description);
  // with a surfel or two more, such an offset is small again in 32 bits
  for (std::size_t i = 0; i < imported.tree.nodes.size(); ++i) {
    std::memset(&bytes[kMapHeaderSize + i * sizeof(Bvh8Node) + offsetof(Bvh8Node, first_leaf_word)],
                0xff,
                4);
  }
  const auto map = SurfelMap::from_bytes(bytes, "a.pfmap");
  ASSERT_EQ(map->nodes()[0].first_leaf_word, 0xffffffffu);
  EXPECT_NO_THROW(static_cast<void>(map->nearest({3, 2, 2}, 10.0)));
}

TEST(MapFile, DamageIsFoundAndNeverCrashes) {
  const ImportedMap imported = import_points(cloud_of(small_room(), 800.0), [] {
    ImportOptions options;
    options.resolution = 0.2;
    return options;
  }());
  const auto good = map_bytes(imported.tree, imported.description);
  const auto open = [](std::vector<std::byte> bytes) {
    return SurfelMap::from_bytes(bytes, "a.pfmap");
  };
  expect_contains(error_of([&] { open({good.begin(), good.begin() + 100}); }), "cut off");
  expect_contains(error_of([&] {
                    open({good.begin(), good.begin() + 5000});
                  }),
                  "does not lie inside");
  auto wrong = good;
  wrong[0] = std::byte{'X'};
  expect_contains(error_of([&] { open(wrong); }), "not a .pfmap file");
  wrong = good;
  wrong[8] = std::byte{99};
  expect_contains(error_of([&] { open(wrong); }), "map version 99, this program reads 1 to 2");
  wrong = good;
  wrong[20] ^= std::byte{1};
  expect_contains(error_of([&] { open(wrong); }), "header is corrupt");
  // a damaged body opens, is found by verify, and answers without harm
  const RandomStream random(5, StreamId::kTest, 0);
  for (std::uint64_t i = 0; i < 60; ++i) {
    wrong = good;
    const auto at = kMapHeaderSize + random.bits(i)[0] % (good.size() - kMapHeaderSize - 64);
    std::memset(&wrong[at], 0xff, 16);
    const auto map = open(wrong);
    if (hash64(wrong) != hash64(good)) {
      expect_contains(error_of([&] { map->verify(); }), "import the cloud again");
    }
    EXPECT_NO_THROW(static_cast<void>(map->nearest({3, 2, 2}, 10.0)));
    std::size_t count = 0;
    map->for_each_surfel([&](const Vector3d&, const Vector3d&, double, std::uint32_t) { ++count; });
    EXPECT_LE(count, good.size());
  }
}

/// A map with another header, whose checksum is right.
std::vector<std::byte> with_header(std::vector<std::byte> bytes,
                                   const std::function<void(MapHeader&)>& change) {
  MapHeader header{};
  std::memcpy(&header, bytes.data(), sizeof header);
  change(header);
  std::memcpy(bytes.data(), &header, sizeof header);
  constexpr std::size_t kChecksumAt = kMapHeaderSize - 8;
  const std::uint64_t checksum = hash64(std::span(bytes).first(kChecksumAt));
  std::memcpy(bytes.data() + kChecksumAt, &checksum, sizeof checksum);
  return bytes;
}

TEST(MapFile, AHeaderThatIsNotTheMapsIsFound) {
  ImportOptions options;
  options.resolution = 0.2;
  const ImportedMap imported = import_points(cloud_of(small_room(), 800.0), options);
  const auto good = map_bytes(imported.tree, imported.description);
  const auto error = [&](const std::function<void(MapHeader&)>& change) {
    return error_of([&] { SurfelMap::from_bytes(with_header(good, change), "a.pfmap")->verify(); });
  };
  EXPECT_NO_THROW(SurfelMap::from_bytes(with_header(good, [](MapHeader&) {}), "a.pfmap")->verify());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double many = 1e300;
  for (const double wrong : {nan, many}) {
    expect_contains(error([&](MapHeader& h) { h.origin[1] = wrong; }), "out of range");
    expect_contains(error([&](MapHeader& h) { h.bounds_min[0] = wrong; }), "out of range");
    expect_contains(error([&](MapHeader& h) { h.bounds_max[2] = wrong; }), "out of range");
  }
  expect_contains(error([](MapHeader& h) { std::swap(h.bounds_min[0], h.bounds_max[0]); }),
                  "out of range");
  expect_contains(error([](MapHeader& h) { ++h.surfel_count; }), "surfels where the header says");
  // a tree without nodes
  ImportedMap bare = import_points(cloud_of(small_room(), 800.0), options);
  bare.tree.nodes = {};
  expect_contains(
      error_of([&] {
        SurfelMap::from_bytes(map_bytes(bare.tree, bare.description), "a.pfmap")->verify();
      }),
      "0 surfels where the header says");
}

}  // namespace
}  // namespace pointflight
