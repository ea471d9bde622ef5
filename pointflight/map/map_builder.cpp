#include "pointflight/map/map_builder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/version.hpp"
#include "pointflight/geometry/morton.hpp"
#include "pointflight/map/noise_projection.hpp"
#include "pointflight/map/spacing.hpp"
#include "pointflight/map/sparse_growth.hpp"
#include "pointflight/map/surfel_fit.hpp"

namespace pointflight {
namespace {

constexpr double kMeshPointsPerCell = 8.0;
constexpr double kDefaultMeshResolution = 0.05;
// walls that coincide with cell faces would split into two layers of cells
constexpr double kGridPhase = -0.37;

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
        progress_(progress) {}

  ImportedMap run() {
    ImportReport& report = map_.report;
    for (const std::string& name : names_) {
      report.sources.push_back(std::filesystem::path(name).filename().string());
    }
    report.resolution_was_chosen = !options_.resolution.has_value();
    if (report.resolution_was_chosen) choose_resolution();
    report.resolution = options_.resolution.value_or(report.supported_resolution);
    accumulate();
    drop_outliers();
    flatten_noise();
    build_tree();
    describe();
    return std::move(map_);
  }

 private:
  /// Calls `visit(point_world, intensity)` for every finite point of all sources.
  template <class Visit>
  void for_each_point(std::string_view what, const Visit& visit) {
    ImportReport& report = map_.report;
    report.points_read = 0;
    report.points_not_finite = 0;
    std::vector<CloudPoint> batch;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      const auto reader = opener_(i);
      report.has_intensity = report.has_intensity || reader->has_intensity();
      while (reader->read(batch)) {
        report.points_read += batch.size();
        for (const CloudPoint& point : batch) {
          const Vector3d p = to_world(point.position);
          if (p.allFinite()) {
            visit(p, std::isfinite(point.intensity) ? point.intensity : 0.0f);
          } else {
            ++report.points_not_finite;
          }
        }
        pointflight::report(
            progress_,
            what,
            (static_cast<double>(i) + reader->share_read()) / static_cast<double>(names_.size()));
      }
    }
    if (report.points_read == 0) throw InputError(fmt::format("{}: no points", names_.front()));
    if (report.points_read == report.points_not_finite) {
      throw InputError(
          fmt::format("{}: all {} points are NaN or infinite", names_.front(), report.points_read));
    }
  }

  [[nodiscard]] Vector3d to_world(const Vector3d& p) const {
    const Vector3d q = options_.scale * p;
    // y up to z up: a quarter turn about x
    return options_.up == 'y' ? Vector3d(q.x(), -q.z(), q.y()) : q;
  }

  void choose_resolution() {
    for_each_point("measuring the point spacing",
                   [this](const Vector3d& p, float) { spacing_.add(p); });
    measure_spacing();
    if (map_.report.supported_resolution <= 0.0) {
      throw InputError(fmt::format("{}: too few points to tell their spacing; give --resolution",
                                   names_.front()));
    }
  }

  void measure_spacing() {
    map_.report.spacing = spacing_.median_spacing();
    map_.report.supported_resolution = supported_resolution(map_.report.spacing);
  }

  void accumulate() {
    ImportReport& report = map_.report;
    const bool measures_spacing = !report.resolution_was_chosen;
    fill_grid(std::nullopt, measures_spacing);
    // the first point may be a stray one far from all others (0 0 0 before a cloud in UTM)
    if (2 * report.points_out_of_reach > report.points_read) fill_grid(spacing_.middle(), false);
    if (measures_spacing) measure_spacing();
    const double r = report.resolution;
    report.cells = grid_->cells().size();
    if (2 * report.points_out_of_reach > report.points_read) {
      throw InputError(fmt::format(
          "{}: {} of {} points lie more than {} km from the first one, too far for a resolution of "
          "{} m; check --scale or give a coarser --resolution",
          names_.front(),
          report.points_out_of_reach,
          report.points_read,
          std::round(r * 1048.576),
          r));
    }
  }

  /// Cells lie around `middle`, or around the first point.
  void fill_grid(const std::optional<Vector3d>& middle, bool measures_spacing) {
    ImportReport& report = map_.report;
    const double r = report.resolution;
    grid_.reset();
    report.points_out_of_reach = 0;
    for_each_point("reading points", [&](const Vector3d& p, float intensity) {
      if (!grid_) {
        const Vector3d base = ((middle.value_or(p) / r).array().floor() + kGridPhase) * r;
        grid_.emplace(base, r);
      }
      if (!grid_->add(p, intensity)) ++report.points_out_of_reach;
      if (measures_spacing) spacing_.add(p);
    });
  }

  void drop_outliers() {
    pointflight::report(progress_, "looking for outliers", 0.0);
    ImportReport& report = map_.report;
    const auto outliers = find_outliers(*grid_, options_.outliers, executor_);
    report.outlier_cells = outliers.size();
    std::vector<bool> dropped(grid_->cells().size(), false);
    for (const std::uint32_t i : outliers) {
      const VoxelCell& cell = grid_->cells()[i];
      dropped[i] = true;
      report.outlier_points += cell.n;
      map_.outliers.push_back(
          {grid_->centroid_world(cell), cell.intensity_sum / static_cast<float>(cell.n)});
    }
    sort_cells(dropped);
  }

  /// Keeps what was not dropped, in Morton order from the lowest corner.
  void sort_cells(const std::vector<bool>& dropped) {
    const auto& cells = grid_->cells();
    std::array<std::int32_t, 3> max = {};
    bool first = true;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (dropped[i]) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::int32_t v = cells[i].voxel[axis];
        min_voxel_[axis] = first ? v : std::min(min_voxel_[axis], v);
        max[axis] = first ? v : std::max(max[axis], v);
      }
      first = false;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (max[axis] - min_voxel_[axis] >= (1 << 20)) {
        throw InputError(fmt::format(
            "{}: the cloud is wider than {} km, too wide for a resolution of {} m; give a coarser "
            "--resolution",
            names_.front(),
            std::round(map_.report.resolution * 1048.576),
            map_.report.resolution));
      }
    }
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
    order.reserve(cells.size());
    for (std::uint32_t i = 0; i < cells.size(); ++i) {
      if (dropped[i]) continue;
      const auto& v = cells[i].voxel;
      order.emplace_back(morton_encode(static_cast<std::uint32_t>(v[0] - min_voxel_[0]),
                                       static_cast<std::uint32_t>(v[1] - min_voxel_[1]),
                                       static_cast<std::uint32_t>(v[2] - min_voxel_[2])),
                         i);
    }
    std::sort(order.begin(), order.end());
    std::vector<std::uint32_t> indices;
    indices.reserve(order.size());
    for (const auto& entry : order) indices.push_back(entry.second);
    grid_->reorder(indices);
  }

  void flatten_noise() {
    pointflight::report(progress_, "measuring the noise", 0.0);
    ImportReport& report = map_.report;
    report.noise = estimate_noise(*grid_, executor_);
    if (!needs_projection(*grid_, report.noise)) return;
    pointflight::report(progress_, "taking the noise out", 0.0);
    grid_ = project_noise(*grid_, report.noise, executor_, report.projection);
    sort_cells(std::vector<bool>(grid_->cells().size(), false));
  }

  void build_tree() {
    pointflight::report(progress_, "fitting surfels", 0.0);
    auto surfels = fit_surfels(*grid_, min_voxel_, executor_);
    ImportReport& report = map_.report;
    pointflight::report(progress_, "closing gaps of thin scans", 0.0);
    report.grown_surfels = grow_sparse_surfels(*grid_, surfels, executor_);
    report.surfels = surfels.size();
    for (const BuildSurfel& surfel : surfels) {
      report.planar_surfels += surfel.s[0] <= kPlanarThickness ? 1 : 0;
    }
    choose_tau(surfels);
    if (report.has_intensity) set_intensities(surfels);
    pointflight::report(progress_, "building the hierarchy", 0.5);
    map_.tree = build_bvh8(surfels, report.resolution, options_.quality);
    pointflight::report(progress_, "building the hierarchy", 1.0);
  }

  /// Dense maps have few holes to bridge and can have sharper edges.
  void choose_tau(const std::vector<BuildSurfel>& surfels) {
    constexpr double kThin = 16.0;
    constexpr double kDense = 40.0;
    ImportReport& report = map_.report;
    std::vector<std::uint32_t> counts;
    for (std::size_t i = 0; i < surfels.size(); ++i) {
      if (surfels[i].s[0] <= kPlanarThickness) counts.push_back(grid_->cells()[i].n);
    }
    if (!counts.empty()) {
      const auto middle = counts.begin() + static_cast<std::ptrdiff_t>(counts.size() / 2);
      std::nth_element(counts.begin(), middle, counts.end());
      report.points_per_cell = *middle;
    }
    const double share = std::clamp((report.points_per_cell - kThin) / (kDense - kThin), 0.0, 1.0);
    report.tau = options_.tau.value_or(static_cast<float>(0.30 + 0.10 * share));
  }

  /// Mean intensity of each cell as a byte between the least and the greatest.
  void set_intensities(std::vector<BuildSurfel>& surfels) {
    const auto& cells = grid_->cells();
    float min = std::numeric_limits<float>::infinity();
    float max = -min;
    const auto mean = [](const VoxelCell& cell) {
      const float value = cell.intensity_sum / static_cast<float>(cell.n);
      return std::isfinite(value) ? value : 0.0f;
    };
    for (const VoxelCell& cell : cells) {
      min = std::min(min, mean(cell));
      max = std::max(max, mean(cell));
    }
    const float step = (max - min) / 255.0f;
    map_.description.intensity_offset = min;
    map_.description.intensity_step = std::isfinite(step) ? step : 0.0f;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const float code = step > 0.0f ? std::round((mean(cells[i]) - min) / step) : 0.0f;
      surfels[i].intensity = static_cast<std::uint8_t>(std::clamp(code, 0.0f, 255.0f));
    }
  }

  void describe() {
    const ImportReport& report = map_.report;
    MapDescription& d = map_.description;
    d.resolution = report.resolution;
    d.origin_world = grid_->base_world() +
                     report.resolution * Vector3d(min_voxel_[0], min_voxel_[1], min_voxel_[2]);
    for (const VoxelCell& cell : grid_->cells()) d.bounds_world.add(grid_->centroid_world(cell));
    d.model.tau = report.tau;
    d.has_intensity = report.has_intensity;
    d.surfel_count = report.surfels;
    nlohmann::ordered_json json;
    json["pointflight"] = kVersion;
    json["sources"] = report.sources;
    json["scale"] = options_.scale;
    json["up"] = std::string(1, options_.up);
    json["resolution"] = report.resolution;
    json["resolution_was_chosen"] = report.resolution_was_chosen;
    json["point_spacing"] = report.spacing;
    json["supported_resolution"] = report.supported_resolution;
    json["points_read"] = report.points_read;
    json["points_not_finite"] = report.points_not_finite;
    json["points_out_of_reach"] = report.points_out_of_reach;
    json["cells"] = report.cells;
    json["outlier_removal"] = {{"enabled", options_.outliers.enabled},
                               {"neighbours", options_.outliers.neighbours},
                               {"sigmas", options_.outliers.sigmas},
                               {"cells_dropped", report.outlier_cells},
                               {"points_dropped", report.outlier_points}};
    json["noise"] = report.noise;
    json["projection"] = {{"kept", report.projection.kept},
                          {"projected", report.projection.projected},
                          {"too_thick", report.projection.too_thick}};
    json["surfels"] = report.surfels;
    json["planar_surfels"] = report.planar_surfels;
    json["points_per_planar_cell"] = report.points_per_cell;
    json["tau"] = static_cast<double>(report.tau);
    json["grown_surfels"] = report.grown_surfels;
    json["has_intensity"] = report.has_intensity;
    d.metadata = json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace);
  }

  const std::vector<std::string>& names_;
  const CloudOpener& opener_;
  const ImportOptions& options_;
  const Executor& executor_;
  const Progress& progress_;
  SpacingEstimate spacing_;
  std::optional<VoxelGrid> grid_;
  std::array<std::int32_t, 3> min_voxel_{};
  ImportedMap map_;
};

}  // namespace

ImportedMap build_map(const std::vector<std::string>& source_names,
                      const CloudOpener& opener,
                      const ImportOptions& options,
                      const Executor& executor,
                      const Progress& progress) {
  return Import(source_names, opener, options, executor, progress).run();
}

ImportedMap import_clouds(const std::vector<std::string>& paths,
                          const ImportOptions& options,
                          const Executor& executor,
                          const Progress& progress) {
  ImportOptions chosen = options;
  const bool has_mesh = std::any_of(paths.begin(), paths.end(), is_mesh);
  // a mesh has no spacing of its own
  if (has_mesh && !chosen.resolution) chosen.resolution = kDefaultMeshResolution;
  MeshSampling sampling;
  sampling.unit = options.scale;
  if (chosen.resolution) {
    sampling.points_per_square_metre =
        kMeshPointsPerCell / (*chosen.resolution * *chosen.resolution);
  }
  const auto opener = [&](std::size_t i) { return open_cloud(paths[i], sampling); };
  ImportedMap map = build_map(paths, opener, chosen, executor, progress);
  map.report.resolution_was_chosen = !options.resolution.has_value();
  return map;
}

}  // namespace pointflight
