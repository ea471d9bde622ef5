#include "pointflight/map/import/map_points.hpp"

#include <cmath>
#include <optional>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/random.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kBatch = 16384;

CloudRow row_of(const SurfelMap& map, const LeafHeader& leaf, std::size_t word) {
  const Surfel surfel = decode(map.words()[word]);
  CloudRow row;
  row.point.position =
      map.origin_world() +
      map.resolution() * (Vector3d(leaf.x, leaf.y, leaf.z) + surfel.center_voxels.cast<double>());
  row.point.intensity = map.intensity(static_cast<std::uint32_t>(word));
  row.normal = surfel.axes.col(0);
  row.spread = surfel.s * static_cast<float>(map.resolution());
  row.axes = Eigen::Quaternionf(surfel.axes).normalized();
  row.surfel = static_cast<std::uint32_t>(word);
  return row;
}

}  // namespace

void for_each_row(const SurfelMap& map,
                  double points_per_square_metre,
                  const std::function<void(std::span<const CloudRow>)>& sink) {
  if (!(points_per_square_metre >= 0.0) || !(points_per_square_metre < 1e12)) {
    throw InputError("a density of points is a number per square metre, 0 or more");
  }
  std::vector<CloudRow> rows;
  const auto push = [&](const CloudRow& row) {
    rows.push_back(row);
    if (rows.size() < kBatch) return;
    sink(rows);
    rows.clear();
  };
  constexpr double kHalf = 1.7320508075688772;  // half sides of what has these deviations
  double owed = 0.0;
  for_each_surfel(map.words(), [&](const LeafHeader& leaf, std::size_t word) {
    const CloudRow row = row_of(map, leaf, word);
    if (points_per_square_metre == 0.0) {
      push(row);
      return;
    }
    owed += points_per_square_metre * map.resolution() * map.resolution();
    const RandomStream random(0, StreamId::kCloudSampling, static_cast<std::uint32_t>(word));
    const Vector3d half = kHalf * row.spread.cast<double>();
    for (std::uint64_t k = 0; owed >= 1.0; ++k, owed -= 1.0) {
      const auto [u, v] = random.uniform2(2 * k);
      CloudRow point = row;
      point.point.position += row.axes.cast<double>() *
                              Vector3d(0.0, (2.0 * u - 1.0) * half.y(), (2.0 * v - 1.0) * half.z());
      push(point);
    }
  });
  if (!rows.empty()) sink(rows);
}

ThinReport thin_cloud(const std::function<std::unique_ptr<CloudReader>()>& opener,
                      double spacing,
                      const ImportOptions& options,
                      const Executor& executor,
                      const std::function<void(std::span<const CloudPoint>)>& sink,
                      const Progress& progress) {
  if (!(spacing > 0.0) || !std::isfinite(spacing)) {
    throw InputError("a spacing is a number of metres above 0");
  }
  Scratch scratch(options.scratch_folder, options.scratch_memory);
  std::optional<CellAccumulator> cells;
  ThinReport thin;
  const auto reader = opener();
  const bool by_color = !reader->has_intensity() && reader->has_color();
  std::vector<CloudPoint> batch;
  while (reader->read(batch)) {
    thin.points_read += batch.size();
    std::size_t finite = 0;
    for (const CloudPoint& point : batch) {
      if (!point.position.allFinite()) continue;
      const float intensity = by_color ? luminance(point) : point.intensity;
      batch[finite++] = {point.position, std::isfinite(intensity) ? intensity : 0.0f};
    }
    thin.points_dropped += batch.size() - finite;
    if (!cells && finite > 0) {
      const Vector3d base = (batch.front().position / spacing).array().floor() * spacing;
      cells.emplace(VoxelFrame{base, spacing}, executor, scratch, options.cells_memory);
    }
    if (cells) thin.points_dropped += cells->add(std::span(batch).first(finite));
    report(progress, "reading points", reader->share_read());
  }
  if (!cells) throw InputError("the cloud has no finite points");
  const CellTiles tiles = cells->finish();
  std::vector<CloudPoint> points;
  for (const CellTile& tile : tiles.tiles()) {
    points.clear();
    for (const VoxelCell& cell : tiles.cells_of(tile)) {
      points.push_back(
          {tiles.frame().centroid_world(cell), cell.intensity_sum / static_cast<float>(cell.n)});
    }
    thin.points += points.size();
    sink(points);
  }
  return thin;
}

}  // namespace pointflight
