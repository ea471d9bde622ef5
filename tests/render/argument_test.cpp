// What a calling program can get wrong is said, and never read beyond an array.
#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "pointflight/io/cloud_reader.hpp"
#include "pointflight/io/csv_table.hpp"
#include "pointflight/io/pcd_writer.hpp"
#include "pointflight/map/import/spacing.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "pointflight/render/internal/paper_renderer.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

const double kNan = std::numeric_limits<double>::quiet_NaN();
const double kInf = std::numeric_limits<double>::infinity();

std::shared_ptr<const SurfelMap> wall() {
  ShapeScene scene;
  scene.add_rectangle({2, -2, -2}, {0, 4, 0}, {0, 0, 4});
  return testing::map_of(scene, 0.1);
}

TEST(Arguments, OfRenderers) {
  EXPECT_THROW(make_renderer("beam", {}), std::invalid_argument);
  EXPECT_THROW(BeamRenderer(Scene{}), std::invalid_argument);
  EXPECT_THROW(PaperRenderer(Scene{}, PaperOptions{}), std::invalid_argument);
  for (const RendererKind& kind : RendererKind::table().rows()) {
    const std::string& name = kind.name;
    SCOPED_TRACE(name);
    const auto renderer = make_renderer(name, {wall()});
    const std::vector<Ray> rays(2);
    std::vector<Hit> hits(2);
    const Executor executor(1);
    const auto refused = [&](const std::function<void(RayBatch&)>& change) {
      RayBatch batch;
      batch.rays = rays;
      change(batch);
      EXPECT_THROW(renderer->render(batch, hits, executor), std::invalid_argument);
    };
    RayBatch fine;
    fine.rays = rays;
    EXPECT_NO_THROW(renderer->render(fine, hits, executor));
    refused([&](RayBatch& batch) { batch.rays = batch.rays.first(1); });
    const std::vector<std::uint32_t> order(1);
    refused([&](RayBatch& batch) { batch.order = order; });
    const std::vector<Duration> offsets(3);
    refused([&](RayBatch& batch) { batch.time_offsets = offsets; });
    refused([&](RayBatch& batch) { batch.T_world_sensor.translation.x() = kNan; });
    refused([&](RayBatch& batch) { batch.T_world_sensor.rotation.w() = kInf; });
    refused([&](RayBatch& batch) { batch.image_resolution = 0.0; });
    std::vector<Body> bodies(1);
    bodies[0].shape = std::shared_ptr<const SurfelMap>();
    refused([&](RayBatch& batch) { batch.bodies = bodies; });
  }
}

#ifndef NDEBUG
TEST(ArgumentsDeathTest, RaysThatAreNotFinite) {
  ::testing::FLAGS_gtest_death_test_style = "threadsafe";
  const auto renderer = make_renderer("paper", {wall()});
  Ray ray;
  ray.direction_world.x() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_DEATH(static_cast<void>(renderer->trace(ray)), "isnan|allFinite");
}
#endif

TEST(Arguments, OfMaps) {
  const auto map = wall();
  EXPECT_TRUE(map->nearest({1.9, 0, 0}, 1.0));
  EXPECT_FALSE(map->nearest({kNan, 0, 0}, 1.0));
  EXPECT_FALSE(map->nearest({1.9, kInf, 0}, 1.0));
  EXPECT_FALSE(map->nearest({1.9, 0, 0}, kNan));
  EXPECT_FALSE(map->nearest({1.9, 0, 0}, -1.0));
  EXPECT_EQ(map->intensity(0xffffffffu), 0.0f);
  EXPECT_THROW(build_map({"x"}, nullptr, {}, Executor(1)), std::invalid_argument);
  EXPECT_THROW(
      build_map(
          {"x"}, [](std::size_t) { return std::unique_ptr<CloudReader>(); }, {}, Executor(1)),
      std::invalid_argument);
  ImportOptions options;
  options.resolution = 0.1;
  ImportedMap imported =
      testing::import_points(std::vector<CloudPoint>(10, {{1, 2, 3}, 0.0f}), options);
  EXPECT_NO_THROW(map_bytes(imported.tree, imported.description));
  imported.description.resolution = 1e9;
  EXPECT_THROW(map_bytes(imported.tree, imported.description), std::invalid_argument);
  imported.description.resolution = 0.1;
  imported.description.origin_world.z() = kNan;
  EXPECT_THROW(map_bytes(imported.tree, imported.description), std::invalid_argument);
  EXPECT_THROW(map_bytes({}, {}), std::invalid_argument);
}

TEST(Arguments, OfReadersAndWriters) {
  const testing::TemporaryFolder folder;
  testing::write_file(folder / "a.xyz", "1 2 3\n");
  EXPECT_THROW(open_cloud(folder / "a.xyz", {kNan, 1.0}), std::invalid_argument);
  EXPECT_THROW(open_cloud(folder / "a.xyz", {1.0, 0.0}), std::invalid_argument);
  EXPECT_THROW(write_pcd(OutputFile(folder / "a.pcd"), {{"x", 'F', 4}}, 2, {}),
               std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.pcd"));
  const CsvTable table("a,b\n1,2\n", "table");
  EXPECT_THROW(static_cast<void>(table.location(1)), std::out_of_range);
}

TEST(Arguments, ResolutionsHaveTwoDigits) {
  EXPECT_EQ(supported_resolution(0.0143), 0.029);
  EXPECT_EQ(supported_resolution(0.00143), 0.0029);
  EXPECT_EQ(supported_resolution(1.0), 2.0);
  EXPECT_EQ(supported_resolution(100.0), 200.0);
  EXPECT_EQ(supported_resolution(123.0), 250.0);
  EXPECT_EQ(supported_resolution(kNan), 0.0);
  EXPECT_EQ(supported_resolution(kInf), 0.0);
  EXPECT_EQ(supported_resolution(0.0), 0.0);
}

}  // namespace
}  // namespace pointflight
