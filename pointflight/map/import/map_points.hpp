#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "pointflight/io/cloud_reader.hpp"
#include "pointflight/io/cloud_writer.hpp"
#include "pointflight/map/import/internal/cell_accumulator.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/map/surfel_map.hpp"

namespace pointflight {

/// Calls `sink` with rows for the surfels of a map, in order: one each, at its centre, or points
/// spread evenly over it if `points_per_square_metre` is above 0. Rows carry intensity, normal
/// and ellipsoid.
void for_each_row(const SurfelMap& map,
                  double points_per_square_metre,
                  const std::function<void(std::span<const CloudRow>)>& sink);

/// What a thinning took and gave.
struct ThinReport {
  std::uint64_t points_read = 0;     ///< Of the cloud.
  std::uint64_t points_dropped = 0;  ///< NaN, infinite, or more than 2^20 cells from the first.
  std::uint64_t points = 0;          ///< Written.
};

/// Thins a cloud: one point for each occupied cell of `spacing` (m), the mean of its points with
/// their mean intensity. Memory is bounded as in an import. Throws InputError.
ThinReport thin_cloud(const std::function<std::unique_ptr<CloudReader>()>& opener,
                      double spacing,
                      const ImportOptions& options,
                      const Executor& executor,
                      const std::function<void(std::span<const CloudPoint>)>& sink,
                      const Progress& progress = {});

}  // namespace pointflight
