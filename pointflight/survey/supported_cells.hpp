// Which positions points support: the one rule by which comparisons choose the rays that count.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>

#include "pointflight/survey/survey_rays.hpp"

namespace pointflight {

/// A position is supported if a point of the cloud, or a return of the scans, that a map was made
/// of lies within 0.1 m of it: then a figure says something of the map and not of what nobody saw.
/// Where sides of surfaces are known (exact scenes), the point must be of the same side
/// (`SeenSurfaces`).
struct Support {
  static constexpr double kRadius = 0.1;  ///< m
  static constexpr double kCell = 0.05;   ///< m: points so near to each other count as one.
};

/// The positions that points support, whatever side they were seen from: those within the radius of
/// the middle of a cell that has some.
class SupportedCells {
 public:
  /// A point; none if it is not finite.
  void add(const Vector3d& point_world);
  /// True if it is supported. Callable from several threads.
  [[nodiscard]] bool has(const Vector3d& point_world) const;

 private:
  /// A bit for each of 4 x 4 x 4 cells.
  std::unordered_map<std::uint64_t, std::uint64_t> blocks_;
};

/// By all returns of a survey.
SupportedCells supported_by(const SurveyOpener& survey);
/// By the points of a cloud's file. Throws InputError, also if there are none.
SupportedCells supported_by_cloud(const std::string& path);

}  // namespace pointflight
