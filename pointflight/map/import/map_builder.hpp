#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/io/cloud_reader.hpp"
#include "pointflight/map/floor_plane.hpp"
#include "pointflight/map/import/internal/cell_accumulator.hpp"
#include "pointflight/map/import/internal/coordinate_steps.hpp"
#include "pointflight/map/import/internal/noise_projection.hpp"
#include "pointflight/map/import/internal/outliers.hpp"
#include "pointflight/map/map_file.hpp"

namespace pointflight {

/// How clouds become a map.
struct ImportOptions {
  std::optional<double> resolution;   ///< r, m; without it the one that the spacing supports.
  bool resolution_is_tried = false;   ///< True: rays found it, no person gave it.
  double scale = 1.0;                 ///< Metres per unit of the file.
  char up = 'z';                      ///< The file's up axis: 'z', or 'y' (turned to z).
  Vector3d shift = Vector3d::Zero();  ///< Added to each point, after scale and up, m.
  OutlierOptions outliers;            ///< Statistical removal, on by default.
  TreeQuality quality = TreeQuality::kHigh;  ///< Of the hierarchy.
  std::optional<float> tau;  ///< Coverage that makes a return; without it by the density.
  /// Where intermediate results lie that exceed the memory below; empty: with temporary files.
  std::string scratch_folder;
  std::size_t scratch_memory = Scratch::kDefaultMemory;        ///< Bytes.
  std::size_t cells_memory = CellAccumulator::kDefaultMemory;  ///< Bytes, while points are read.
};

/// A source whose file names the unit of its coordinates.
struct SourceUnit {
  std::string source;  ///< File name without folder.
  FileUnit unit;       ///< As its file names it.
};

/// What of a file's columns was read, if there is something to say.
struct SourceColumns {
  std::string source;   ///< File name without folder.
  FileColumns columns;  ///< As its reader says.
};

/// A source whose coordinates have too few digits.
struct CoarseSource {
  std::string source;             ///< File name without folder.
  CoarseCoordinates coordinates;  ///< In the file's unit.
};

/// What an import did, for the user and for the map's metadata.
struct ImportReport {
  std::vector<std::string> sources;       ///< File names without folders.
  std::uint64_t points_read = 0;          ///< Of all sources, those below included.
  std::uint64_t points_not_finite = 0;    ///< NaN or infinite: left out.
  std::uint64_t points_out_of_reach = 0;  ///< More than 2^20 cells from the first point.
  std::uint64_t cells = 0;                ///< Occupied, before outliers are dropped.
  std::uint64_t outlier_cells = 0;        ///< Dropped.
  std::uint64_t outlier_points = 0;       ///< In the dropped cells.
  std::uint64_t surfels = 0;              ///< In the map.
  std::uint64_t merged_surfels = 0;       ///< Those that stand for several cells amid a plane.
  std::uint64_t wide_surfels = 0;         ///< Of them, those that stand for several thin cells.
  std::uint64_t small_surfels = 0;        ///< Of them, those that stand for part of a cell.
  std::uint64_t planar_surfels = 0;       ///< Of them, those of thickness class 0.
  double noise = 0.0;                     ///< Deviation of the points across flat surfaces, m.
  ProjectionReport projection;            ///< All zero if the cloud was clean.
  double points_per_cell = 0.0;           ///< Median of the planar surfels.
  float tau = 0.0f;                       ///< Coverage that makes a return.
  std::uint64_t grown_surfels = 0;        ///< Widened if the scan is thin.
  double resolution = 0.0;                ///< r, m.
  Vector3d size = Vector3d::Zero();       ///< Of the box around the surfels, m.
  double spacing = 0.0;                   ///< Median nearest-neighbour distance, m; 0 if unknown.
  double supported_resolution = 0.0;      ///< 2 spacings.
  bool resolution_was_chosen = false;     ///< True: by the spacing, since no option gave one.
  bool resolution_was_tried = false;      ///< True: rays found it.
  bool has_intensity = false;             ///< A source has them.
  bool intensity_from_colors = false;     ///< Of a source that has colours and no intensity.
  bool has_mesh = false;                  ///< A source was sampled.
  std::vector<SourceUnit> units;          ///< Of the sources that name one.
  std::vector<SourceColumns> columns;     ///< Of the sources that say something.
  std::vector<CoarseSource> coarse;       ///< The sources whose points are rounded too much.
  std::vector<std::string> y_up;          ///< The sources that say that y is up.
  double intensity_outliers_from = 0.0;   ///< Steps are coarser above; 0: they are all equal.
  std::optional<FloorPlane> floor;        ///< Where one was found.
  std::vector<std::string> warnings;      ///< What looks wrong about this world, one line each.
};

/// A finished import in memory.
struct ImportedMap {
  Bvh8 tree;                         ///< What rays and distances ask.
  MapDescription description;        ///< What `write_map` stores beside it.
  ImportReport report;               ///< What was done.
  std::vector<CloudPoint> outliers;  ///< Centroids of the dropped cells.
};

/// Where a point of a source lies in the map: scaled, turned, shifted; m.
Vector3d world_position(const Vector3d& position, const ImportOptions& options);

/// Opens the sources again for each pass over the points.
using CloudOpener = std::function<std::unique_ptr<CloudReader>(std::size_t source)>;

/// Builds a map from clouds that are streamed, never held. `opener(i)` opens source i of
/// `source_names`. Throws InputError (empty cloud, all NaN, too wide for the resolution, ...).
ImportedMap build_map(const std::vector<std::string>& source_names,
                      const CloudOpener& opener,
                      const ImportOptions& options,
                      const Executor& executor,
                      const Progress& progress = {});

/// Imports clouds and meshes; meshes are sampled at 8 points per r^2.
ImportedMap import_clouds(const std::vector<CloudSource>& sources,
                          const ImportOptions& options,
                          const Executor& executor,
                          const Progress& progress = {});

}  // namespace pointflight
