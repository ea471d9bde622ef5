#include "pointflight/view/map_blocks.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <set>

#include "pointflight/view/page_content.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

template <class T>
T at(const std::vector<std::byte>& bytes, std::size_t offset) {
  T value{};
  EXPECT_LE(offset + sizeof value, bytes.size());
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

std::shared_ptr<const SurfelMap> yard() {
  ShapeScene scene;
  scene.add_box({-20, -15, -1}, {20, 15, 6});
  scene.shapes.emplace_back(SceneSphere{{3, 2, 1}, 1.5});
  return testing::map_of(scene, 0.2);
}

TEST(MapBlocks, HaveEachSurfelOnceWhereItIs) {
  const auto map = yard();
  const MapBlocks blocks(map);
  ASSERT_GT(blocks.size(), 3u);
  const std::vector<std::byte> index = blocks.index();
  EXPECT_EQ(index.size(), 56 + 28 * blocks.size());
  EXPECT_EQ(at<std::uint32_t>(index, 4), blocks.size());
  EXPECT_EQ(at<std::uint32_t>(index, 8), map->surfel_count());
  EXPECT_EQ(at<double>(index, 40), map->resolution());
  std::multiset<std::array<double, 3>> wanted;
  map->for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t) {
    wanted.insert({p.x(), p.y(), p.z()});
  });
  std::size_t total = 0;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const std::vector<std::byte> rows = blocks.block(b, 0);
    const auto count = at<std::uint32_t>(rows, 0);
    EXPECT_EQ(rows.size(), 16 + 16 * std::size_t{count});
    EXPECT_EQ(count, at<std::uint32_t>(index, 56 + 28 * b + 24));
    EXPECT_LE(count, MapBlocks::kSurfels + 8);
    total += count;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t row = 16 + 16 * i;
      const auto word = at<SurfelWord>(rows, row);
      Vector3d leaf;
      for (int k = 0; k < 3; ++k) {
        leaf[k] = at<std::uint32_t>(rows, 4 + 4 * static_cast<std::size_t>(k)) +
                  at<std::uint16_t>(rows, row + 8 + 2 * static_cast<std::size_t>(k));
      }
      const Vector3d p =
          map->origin_world() + map->resolution() * (leaf + center_voxels(word).cast<double>());
      for (int k = 0; k < 3; ++k) {
        const double from = p[k] - map->origin_world()[k];
        const std::size_t box = 56 + 28 * b + 4 * static_cast<std::size_t>(k);
        ASSERT_GE(from, at<float>(index, box) - 1e-4f);
        ASSERT_LE(from, at<float>(index, box + 12) + 1e-4f);
      }
      const auto found = wanted.lower_bound({p.x() - 1e-9, p.y() - 1, p.z() - 1});
      ASSERT_NE(found, wanted.end());
      ASSERT_NEAR((*found)[0], p.x(), 1e-6);
    }
  }
  EXPECT_EQ(total, map->surfel_count());
}

TEST(MapBlocks, LevelsAndTheOverviewAreThinner) {
  const auto map = yard();
  const MapBlocks blocks(map);
  const auto full = at<std::uint32_t>(blocks.block(0, 0), 0);
  for (int level = 1; level < MapBlocks::kLevels; ++level) {
    const auto count = at<std::uint32_t>(blocks.block(0, level), 0);
    EXPECT_NEAR(count, full / static_cast<double>(1 << (2 * level)), 1.0);
  }
  EXPECT_TRUE(blocks.block(blocks.size(), 0).empty());
  EXPECT_TRUE(blocks.block(0, MapBlocks::kLevels).empty());
  EXPECT_TRUE(blocks.block(0, -1).empty());
  for (const std::size_t most : {0u, 1000u, 100000000u}) {
    const std::vector<std::byte> all = blocks.overview(most);
    std::size_t surfels = 0;
    std::size_t heads = 0;
    for (std::size_t offset = 4; offset < all.size(); ++heads) {
      const auto count = at<std::uint32_t>(all, offset);
      surfels += count;
      offset += 16 + 16 * std::size_t{count};
    }
    EXPECT_EQ(heads, blocks.size());
    if (most == 1000) {
      EXPECT_NEAR(static_cast<double>(surfels), 1000.0, 500.0);
    }
    if (most > 1000) {
      EXPECT_EQ(surfels, map->surfel_count());
    }
  }
}

TEST(PageContent, KnowsItsPathsAndNoOthers) {
  const testing::TemporaryFolder folder;
  testing::write_file(folder / "index.html", "<p>");
  testing::write_file(folder / "page.js", "1");
  testing::write_file(folder / "secret", "x");
  const auto content = page_content(folder.path(), std::make_shared<const MapBlocks>(yard()));
  EXPECT_EQ(content("/")->type, "text/html; charset=utf-8");
  EXPECT_EQ(content("/page.js")->bytes->size(), 1u);
  EXPECT_TRUE(content("/map/index"));
  EXPECT_TRUE(content("/map/overview/100"));
  EXPECT_TRUE(content("/map/block/0/1"));
  for (const char* path : {"/secret",
                           "/../secret",
                           "//",
                           "",
                           "/map/",
                           "/map/block/",
                           "/map/block/0",
                           "/map/block/0/9",
                           "/map/block/-1/0",
                           "/map/block/1e3/0",
                           "/map/block/0/0/0",
                           "/map/overview/",
                           "/map/overview/x",
                           "/map/overview/nan",
                           "/map/../secret",
                           "/page.js/",
                           "/map/block/99999999999999999999/0",
                           "/map/block/0/1e99"}) {
    EXPECT_FALSE(content(path)) << path;
  }
}

}  // namespace
}  // namespace pointflight
