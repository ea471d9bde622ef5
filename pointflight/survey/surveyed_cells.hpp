#pragma once

#include <cstdint>
#include <unordered_set>

#include "pointflight/survey/survey_rays.hpp"

namespace pointflight {

/// Which positions a survey has seen: those with a return in the same or a neighbouring cube of 0.1
/// m.
class SurveyedCells {
 public:
  /// A return.
  void add(const Vector3d& point_world);
  /// True beside one.
  [[nodiscard]] bool has(const Vector3d& point_world) const;

 private:
  std::unordered_set<std::uint64_t> cells_;
};

/// Of all returns of a survey.
SurveyedCells surveyed_cells(const SurveyOpener& survey);

}  // namespace pointflight
