// What the .pfmap file may hold: versions, sections that are unknown, sections that are missing.
#include "pointflight/map/map_file.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "pointflight/core/hash.hpp"
#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/map/build/map_builder.hpp"
#include "pointflight/map/edit/map_edit.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;

/// A ball with intensities.
const ImportedMap& ball() {
  static const ImportedMap map = [] {
    ShapeScene scene;
    scene.shapes.emplace_back(Sphere{{1, 0, 0}, 0.5});
    std::vector<CloudPoint> points;
    scene.sample(2000.0, 0.002, 1, [&](const Vector3d& p) {
      points.push_back({p, static_cast<float>(p.z())});
    });
    ImportOptions options;
    options.resolution = 0.1;
    return testing::import_points(points, options);
  }();
  return map;
}

std::shared_ptr<const SurfelMap> opened(const std::vector<std::byte>& bytes) {
  return SurfelMap::from_bytes(bytes, "m.pfmap");
}

void seal(std::vector<std::byte>& bytes) {
  const std::uint64_t checksum = hash64(std::span(bytes).first(kMapHeaderSize - 8));
  std::memcpy(bytes.data() + kMapHeaderSize - 8, &checksum, sizeof checksum);
}

/// The table of a version 2 file, to be changed.
std::span<MapSection> table_of(std::vector<std::byte>& bytes) {
  MapHeader header{};
  std::memcpy(&header, bytes.data(), sizeof header);
  return {reinterpret_cast<MapSection*>(bytes.data() + sizeof header), header.section_count};
}

/// The same file as version 1 has it.
std::vector<std::byte> as_version_1(std::vector<std::byte> bytes) {
  const std::vector<MapSection> table(table_of(bytes).begin(), table_of(bytes).end());
  MapHeader header{};
  std::memcpy(&header, bytes.data(), sizeof header);
  header.version = 1;
  std::fill(bytes.begin(), bytes.begin() + kMapHeaderSize, std::byte{0});
  std::memcpy(bytes.data(), &header, sizeof header);
  for (std::size_t i = 0; i < 4; ++i) {
    const MapSectionV1 old{table[i].offset, table[i].size, table[i].checksum};
    std::memcpy(bytes.data() + sizeof header + i * sizeof old, &old, sizeof old);
  }
  seal(bytes);
  return bytes;
}

TEST(MapFile, Version1OpensAndIsTheSameMap) {
  const std::vector<std::byte> bytes = map_bytes(ball().tree, ball().description);
  const auto now = opened(bytes);
  const auto old = opened(as_version_1(bytes));
  old->verify();
  EXPECT_EQ(old->hash(), now->hash());
  EXPECT_EQ(old->metadata(), now->metadata());
  EXPECT_EQ(old->file_size(), now->file_size());
  EXPECT_TRUE(std::equal(
      old->words().begin(), old->words().end(), now->words().begin(), now->words().end()));
  EXPECT_EQ(old->intensity(20), now->intensity(20));
}

TEST(MapFile, SaysWhatReflectivityAnIntensityStandsFor) {
  MapDescription description = ball().description;
  const auto plain = opened(map_bytes(ball().tree, description));
  EXPECT_EQ(plain->reflectivity_per_intensity(), 0.0);
  set_reflectivity(description, 0.01);
  const auto map = opened(map_bytes(ball().tree, description));
  EXPECT_EQ(map->reflectivity_per_intensity(), 0.01);
  EXPECT_NE(map->hash(), plain->hash()) << "returns hang on it";
  EXPECT_EQ(description_of(*map).extra.size(), 1u) << "edits keep it";
  set_reflectivity(description, 0.0);
  EXPECT_TRUE(description.extra.empty());
  for (const std::vector<std::byte>& wrong :
       {std::vector<std::byte>(4, std::byte{1}), std::vector<std::byte>(8, std::byte{0xff})}) {
    set_section(description, kReflectivitySection, wrong);
    const auto bytes = map_bytes(ball().tree, description);
    expect_contains(error_of([&] { opened(bytes); }), "the section 'reflectivity' is corrupt");
  }
}

TEST(MapFile, UnknownSectionsAreLeftAloneAndCanBeRead) {
  MapDescription description = ball().description;
  const std::vector<std::byte> label(ball().tree.words.size(), std::byte{7});
  description.extra = {{"label", label}, {"sixteen_bytes_ok", {}}};
  const auto map = opened(map_bytes(ball().tree, description));
  map->verify();
  EXPECT_EQ(map->section("label").size(), label.size());
  EXPECT_EQ(map->section("label")[3], std::byte{7});
  EXPECT_TRUE(map->section("opacity").empty());
  const auto plain = opened(map_bytes(ball().tree, ball().description));
  EXPECT_NE(map->hash(), plain->hash());
  EXPECT_EQ(map->nearest({1, 0, 0}, 3.0)->distance, plain->nearest({1, 0, 0}, 3.0)->distance);
  // damage in one is found by its name
  auto bytes = map_bytes(ball().tree, description);
  bytes[table_of(bytes)[4].offset] = std::byte{8};
  expect_contains(error_of([&] { opened(bytes)->verify(); }), "section 'label'");
  description.extra = {{"twice", {}}, {"twice", {}}};
  EXPECT_THROW(static_cast<void>(map_bytes(ball().tree, description)), std::invalid_argument);
  for (const char* name : {"", "words", "seventeen_bytes_x"}) {
    description.extra = {{name, {}}};
    EXPECT_THROW(static_cast<void>(map_bytes(ball().tree, description)), std::invalid_argument);
  }
}

TEST(MapFile, SectionsThatAreNotNeededMayBeMissing) {
  auto bytes = map_bytes(ball().tree, ball().description);
  // intensity and metadata by names that nobody knows
  std::memcpy(table_of(bytes)[2].name, "x", 2);
  std::memcpy(table_of(bytes)[3].name, "y", 2);
  seal(bytes);
  const auto bare = opened(bytes);
  bare->verify();
  EXPECT_FALSE(bare->has_intensity());
  EXPECT_EQ(bare->metadata(), "");
  EXPECT_EQ(bare->intensity(20), 0.0f);
  std::memcpy(table_of(bytes)[1].name, "z", 2);
  seal(bytes);
  expect_contains(error_of([&] { opened(bytes); }), "section lengths do not fit");
}

TEST(MapFile, TablesThatCannotBeAreRefused) {
  const auto good = map_bytes(ball().tree, ball().description);
  const auto with = [&](const auto& change) {
    auto bytes = good;
    change(bytes);
    seal(bytes);
    return error_of([&] { opened(bytes); });
  };
  const auto count = [](std::vector<std::byte>& bytes, std::uint32_t value) {
    std::memcpy(bytes.data() + offsetof(MapHeader, section_count), &value, sizeof value);
  };
  expect_contains(with([&](auto& b) { count(b, 1000); }), "wrong number of sections");
  expect_contains(with([&](auto& b) { count(b, 0); }), "wrong number of sections");
  expect_contains(with([&](auto& b) { std::memcpy(table_of(b)[3].name, "nodes\0\0\0\0", 9); }),
                  "two sections are called 'nodes'");
  expect_contains(with([&](auto& b) { table_of(b)[3].size = 1ull << 60; }),
                  "the section 'metadata'");
  expect_contains(with([&](auto& b) { table_of(b)[2].offset += 1; }), "the section 'intensity'");
  expect_contains(with([](auto& b) { b[8] = std::byte{3}; }),
                  "map version 3, this program reads 1 to 2");
}

}  // namespace
}  // namespace pointflight
