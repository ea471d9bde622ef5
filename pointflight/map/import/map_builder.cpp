#include "pointflight/map/import/map_builder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <span>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/io/internal/read_ahead.hpp"
#include "pointflight/map/import/import_check.hpp"
#include "pointflight/map/import/internal/chosen_surfels.hpp"
#include "pointflight/map/import/internal/import_metadata.hpp"
#include "pointflight/map/import/internal/noise_projection.hpp"
#include "pointflight/map/import/internal/small_cells.hpp"
#include "pointflight/map/import/internal/sparse_growth.hpp"
#include "pointflight/map/import/internal/surfel_fit.hpp"
#include "pointflight/map/import/internal/wide_cells.hpp"
#include "pointflight/map/import/spacing.hpp"

namespace pointflight {
namespace {

constexpr double kMeshPointsPerCell = 8.0;
constexpr double kDefaultMeshResolution = 0.05;
// walls that coincide with cell faces would split into two layers of cells
constexpr double kGridPhase = -0.37;

/// Coverage that makes a return, by the median of points per planar surfel: thin maps have holes to
/// bridge; the denser, the sharper their edges can be. Measured between 1 and 80 points, on exact
/// scenes and on real scans (docs/fidelity.md).
double tau_for(double points_per_surfel) {
  constexpr double kMany = 32.0;
  constexpr double kDense = 64.0;
  const double share = std::clamp((points_per_surfel - kMany) / (kDense - kMany), 0.0, 1.0);
  return 0.36 + 0.04 * share;
}

/// One import: the passes over the points in order.
class Import {
 public:
  Import(const std::vector<std::string>& names,
         const CloudOpener& opener,
         const ImportOptions& options,
         const Executor& executor,
         const Progress& progress)
      : names_(names),
        opener_(opener),
        options_(options),
        executor_(executor),
        progress_(progress),
        scratch_(options.scratch_folder, options.scratch_memory) {}

  ImportedMap run() {
    ImportReport& report = map_.report;
    check_options(options_);
    if (names_.empty()) throw InputError("no clouds are given; name at least one");
    for (const std::string& name : names_) {
      report.sources.push_back(std::filesystem::path(name).filename().string());
    }
    report.resolution_was_chosen = !options_.resolution.has_value();
    report.resolution_was_tried = options_.resolution_is_tried;
    if (report.resolution_was_chosen) choose_resolution();
    report.resolution = options_.resolution.value_or(report.supported_resolution);
    check_resolution();
    accumulate();
    drop_outliers();
    flatten_noise();
    build_tree();
    report.floor =
        find_floor(map_.tree.words.span(), map_.description.origin_world, report.resolution);
    describe();
    return std::move(map_);
  }

 private:
  /// Calls `visit(batch)` with the finite points of all sources, in the world, batch by batch.
  void for_each_batch(std::string_view what,
                      const std::function<void(std::span<const CloudPoint>)>& visit) {
    ImportReport& report = map_.report;
    report.points_read = 0;
    report.points_not_finite = 0;
    report.units.clear();
    report.columns.clear();
    report.coarse.clear();
    report.y_up.clear();
    for (std::size_t i = 0; i < names_.size(); ++i) {
      const auto reader = opener_(i);
      require_argument(reader != nullptr, "build_map: the opener gave no reader");
      const bool by_color = !reader->has_intensity() && reader->has_color();
      report.has_intensity = report.has_intensity || reader->has_intensity() || by_color;
      report.intensity_from_colors = report.intensity_from_colors || by_color;
      if (const auto unit = reader->unit()) report.units.push_back({report.sources[i], *unit});
      if (reader->up_axis() == 'y') report.y_up.push_back(report.sources[i]);
      CoordinateSteps steps;
      // while one batch is used, the next one is read
      ReadAhead ahead(*reader, executor_.threads() > 1);
      std::vector<CloudPoint> batch;
      while (ahead.read(batch)) {
        report.points_read += batch.size();
        steps.add(batch);
        std::size_t finite = 0;
        for (const CloudPoint& point : batch) {
          const Vector3d p = world_position(point.position, options_);
          if (!p.allFinite()) continue;
          const float intensity = by_color ? luminance(point) : point.intensity;
          batch[finite++] = {p, std::isfinite(intensity) ? intensity : 0.0f};
        }
        report.points_not_finite += batch.size() - finite;
        visit(std::span(batch).first(finite));
        pointflight::report(
            progress_,
            what,
            (static_cast<double>(i) + ahead.share_read()) / static_cast<double>(names_.size()));
      }
      report.columns.push_back({report.sources[i], reader->columns()});
      if (const auto coarse = steps.coarse(options_.scale)) {
        report.coarse.push_back({report.sources[i], *coarse});
      }
    }
    if (report.points_read == 0) throw InputError(fmt::format("{}: no points", names_.front()));
    if (report.points_read == report.points_not_finite) {
      throw InputError(
          fmt::format("{}: all {} points are NaN or infinite", names_.front(), report.points_read));
    }
  }

  void choose_resolution() {
    for_each_batch("measuring the point spacing",
                   [this](std::span<const CloudPoint> points) { spacing_.add(points, executor_); });
    measure_spacing();
    if (map_.report.supported_resolution <= 0.0) {
      throw InputError(fmt::format("{}: too few points to tell their spacing; give --resolution",
                                   names_.front()));
    }
  }

  /// What could not be opened again is not written.
  void check_resolution() const {
    const double r = map_.report.resolution;
    if (r >= kMinResolution && r <= kMaxResolution) return;
    throw InputError(fmt::format(
        "{}: a resolution of {:.3g} m is none that maps have ({:g} to {:g} m); the points lie "
        "{:.3g} m apart: check --scale, or give --resolution",
        names_.front(),
        r,
        kMinResolution,
        kMaxResolution,
        map_.report.spacing));
  }

  void measure_spacing() {
    map_.report.spacing = spacing_.median_spacing();
    map_.report.supported_resolution = supported_resolution(map_.report.spacing);
  }

  void accumulate() {
    ImportReport& report = map_.report;
    const bool measures_spacing = !report.resolution_was_chosen;
    fill_cells(std::nullopt, measures_spacing);
    // the first point may be a stray one far from all others (0 0 0 before a cloud in UTM)
    if (2 * report.points_out_of_reach > report.points_read) fill_cells(spacing_.middle(), false);
    pointflight::report(progress_, "measuring the point spacing", 0.0);
    if (measures_spacing) measure_spacing();
    const double r = report.resolution;
    report.cells = cells_.count();
    if (2 * report.points_out_of_reach > report.points_read) {
      throw InputError(fmt::format(
          "{}: {} of {} points lie more than {} km from the first one, too far for a resolution of "
          "{:.4g} m; check --scale or give a coarser --resolution",
          names_.front(),
          report.points_out_of_reach,
          report.points_read,
          std::round(r * 1048.576),
          r));
    }
  }

  /// Cells lie around `middle`, or around the first point.
  void fill_cells(const std::optional<Vector3d>& middle, bool measures_spacing) {
    ImportReport& report = map_.report;
    const double r = report.resolution;
    report.points_out_of_reach = 0;
    std::optional<CellAccumulator> accumulator;
    for_each_batch("reading points", [&](std::span<const CloudPoint> points) {
      if (!accumulator && !points.empty()) {
        const Vector3d inside = middle.value_or(points.front().position);
        const Vector3d base = ((inside / r).array().floor() + kGridPhase) * r;
        accumulator.emplace(VoxelFrame{base, r}, executor_, scratch_, options_.cells_memory);
      }
      if (!points.empty()) report.points_out_of_reach += accumulator->add(points);
      if (measures_spacing) spacing_.add(points, executor_);
    });
    pointflight::report(progress_, "sorting cells", 0.0);
    cells_ = accumulator->finish();
  }

  void drop_outliers() {
    Outliers outliers =
        pointflight::drop_outliers(cells_, options_.outliers, executor_, scratch_, progress_);
    map_.report.outlier_cells = outliers.centroids_world.size();
    map_.report.outlier_points = outliers.points;
    map_.outliers = std::move(outliers.centroids_world);
  }

  void flatten_noise() {
    pointflight::report(progress_, "measuring the noise", 0.0);
    ImportReport& report = map_.report;
    report.noise = estimate_noise(cells_, executor_);
    if (!needs_projection(cells_, report.noise)) return;
    cells_ = project_noise(cells_, report.noise, executor_, scratch_, report.projection, progress_);
  }

  void build_tree() {
    ImportReport& report = map_.report;
    find_bounds();
    const ChosenSurfels chosen = choose_scales();
    report.surfels = chosen.surfels.size();
    report.planar_surfels = chosen.planar;
    report.points_per_cell = chosen.points_per_planar;
    report.tau = options_.tau.value_or(static_cast<float>(tau_for(report.points_per_cell)));
    set_levels(map_.description, chosen.levels);
    report.intensity_outliers_from = chosen.levels.is_linear ? 0.0 : chosen.levels.usual_end();
    map_.description.bounds_world =
        bounds_of(chosen.surfels.span(), cells_.frame().base_world, report.resolution);
    report.size = map_.description.bounds_world.size();
    cells_ = {};  // room for the tree
    pointflight::report(progress_, "building the hierarchy", 0.0);
    TreeInput input{chosen.surfels, chosen.intensity, {}, report.resolution};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      input.low[axis] = static_cast<std::uint32_t>(min_voxel_[axis] + kMaxVoxel);
    }
    map_.tree = build_bvh8(input, options_.quality, executor_, scratch_);
    pointflight::report(progress_, "building the hierarchy", 1.0);
  }

  /// Surfels of the cells, of wider ones if points are thin, of smaller ones if many lie on
  /// something that is not flat.
  ChosenSurfels choose_scales() {
    ImportReport& report = map_.report;
    const auto surfels = fit_surfels(cells_, executor_, scratch_, progress_);
    pointflight::report(progress_, "closing gaps of thin scans", 0.0);
    const SparseBlocks sparse(cells_, surfels, executor_);
    const WideSurfels wide = surfels_of_wide_cells(
        cells_, surfels, sparse, report.noise, executor_, scratch_, progress_);
    report.wide_surfels = wide.thin;
    report.merged_surfels = wide.merged;
    report.grown_surfels =
        grow_sparse_surfels(cells_, surfels, wide.covered, sparse, executor_, progress_);
    ScratchArray<SurfelPiece> small;
    SmallCells splitting(cells_, surfels, wide.covered, executor_, scratch_, options_.cells_memory);
    if (!splitting.empty()) {
      for_each_batch("splitting cells",
                     [&](std::span<const CloudPoint> points) { splitting.add(points); });
      small = splitting.finish(progress_);
    }
    report.small_surfels = small.size();
    return choose_surfels(
        cells_, surfels, wide.covered, wide.pieces, small, report.has_intensity, scratch_);
  }

  /// Where the map lies, in voxels.
  void find_bounds() {
    struct Bounds {
      std::array<std::int32_t, 3> min{kMaxVoxel, kMaxVoxel, kMaxVoxel};
      std::array<std::int32_t, 3> max{-kMaxVoxel, -kMaxVoxel, -kMaxVoxel};
    };
    std::vector<Bounds> of_tile(cells_.tiles().size());
    cells_.for_each_tile(executor_, [&](std::size_t t, std::span<VoxelCell> cells) {
      for (const VoxelCell& cell : cells) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          of_tile[t].min[axis] = std::min(of_tile[t].min[axis], cell.voxel[axis]);
          of_tile[t].max[axis] = std::max(of_tile[t].max[axis], cell.voxel[axis]);
        }
      }
    });
    Bounds all;
    for (const Bounds& bounds : of_tile) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        all.min[axis] = std::min(all.min[axis], bounds.min[axis]);
        all.max[axis] = std::max(all.max[axis], bounds.max[axis]);
      }
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (all.max[axis] - all.min[axis] >= (1 << 20)) {
        throw InputError(
            fmt::format("{}: the cloud is wider than {} km, too wide for a resolution of {:.4g} m; "
                        "give a coarser "
                        "--resolution",
                        names_.front(),
                        std::round(map_.report.resolution * 1048.576),
                        map_.report.resolution));
      }
    }
    min_voxel_ = all.min;
    map_.description.origin_world =
        cells_.frame().base_world +
        map_.report.resolution * Vector3d(min_voxel_[0], min_voxel_[1], min_voxel_[2]);
  }

  void describe() {
    const ImportReport& report = map_.report;
    MapDescription& d = map_.description;
    d.resolution = report.resolution;
    d.model.tau = report.tau;
    d.has_intensity = report.has_intensity;
    d.surfel_count = report.surfels;
    d.metadata = import_metadata(report, options_);
  }

  const std::vector<std::string>& names_;
  const CloudOpener& opener_;
  const ImportOptions& options_;
  const Executor& executor_;
  const Progress& progress_;
  Scratch scratch_;
  SpacingEstimate spacing_;
  CellTiles cells_;
  std::array<std::int32_t, 3> min_voxel_{};
  ImportedMap map_;
};

}  // namespace

Vector3d world_position(const Vector3d& position, const ImportOptions& options) {
  const Vector3d p = options.scale * position;
  // y up to z up: a quarter turn about x
  return (options.up == 'y' ? Vector3d(p.x(), -p.z(), p.y()) : p) + options.shift;
}

ImportedMap build_map(const std::vector<std::string>& source_names,
                      const CloudOpener& opener,
                      const ImportOptions& options,
                      const Executor& executor,
                      const Progress& progress) {
  require_argument(opener != nullptr, "build_map: an opener of sources is wanted");
  return Import(source_names, opener, options, executor, progress).run();
}

ImportedMap import_clouds(const std::vector<CloudSource>& sources,
                          const ImportOptions& options,
                          const Executor& executor,
                          const Progress& progress) {
  ImportOptions chosen = options;
  const bool has_mesh = std::any_of(
      sources.begin(), sources.end(), [](const CloudSource& source) { return source.is_mesh(); });
  // a mesh has no spacing of its own
  if (has_mesh && !chosen.resolution) chosen.resolution = kDefaultMeshResolution;
  MeshSampling sampling;
  sampling.unit = options.scale;
  if (chosen.resolution) {
    sampling.points_per_square_metre =
        kMeshPointsPerCell / (*chosen.resolution * *chosen.resolution);
  }
  std::vector<std::string> names;
  names.reserve(sources.size());
  for (const CloudSource& source : sources) names.push_back(source.name());
  const auto opener = [&](std::size_t i) { return sources[i].open(sampling, progress); };
  ImportedMap map = build_map(names, opener, chosen, executor, progress);
  map.report.resolution_was_chosen = !options.resolution.has_value();
  map.report.has_mesh = has_mesh;
  map.report.warnings = import_warnings(map.report, options, map.description.bounds_world);
  return map;
}

}  // namespace pointflight
