#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "pointflight/survey/supported_cells.hpp"
#include "pointflight/survey/survey_rays.hpp"

namespace pointflight {

/// Which sides of which surfaces a survey supports (`Support`). What was seen of a trunk or of a
/// partition from its front says nothing about its back, however thin it is.
class SeenSurfaces {
 public:
  /// Adds a return; rays without one show no surface.
  void add(const SurveyRay& ray);
  /// True if a return lies within `Support::kRadius` of the point whose ray hit the side that the
  /// unit normal points away from. Of returns in the same 5 cm from about the same direction the
  /// first stands for all.
  [[nodiscard]] bool has(const Vector3d& point_world, const Vector3f& normal_world) const;

 private:
  struct Return {
    Vector3f from_corner;      ///< Of its cell, m.
    Vector3f direction_world;  ///< Of the ray.
    std::uint8_t kind;         ///< Same position and direction, roughly: one stands for all.
  };
  std::unordered_map<std::uint64_t, std::vector<Return>> cells_;
};

/// All that a survey has seen.
SeenSurfaces surfaces_of(const SurveyOpener& survey);

}  // namespace pointflight
