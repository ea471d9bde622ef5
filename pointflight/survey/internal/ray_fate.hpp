#pragma once

#include <cstdint>

#include "pointflight/survey/survey_rays.hpp"

namespace pointflight {

/// How a ray of the survey is rendered.
enum class Fate : std::uint8_t {
  kEarly,  ///< Nearer than it returned, or within what a ray without a return found free.
  kLeak,   ///< Farther, or not at all.
  kRight,
  kFree,  ///< Neither returned nor rendered.
};

/// Of a range rendered (m, negative: nothing was hit), right within `right` (m).
inline Fate fate_of(const SurveyRay& ray, float rendered, float right) {
  if (!ray.is_return) return rendered < 0.0f ? Fate::kFree : Fate::kEarly;
  if (rendered < 0.0f || rendered > ray.range + right) return Fate::kLeak;
  return rendered < ray.range - right ? Fate::kEarly : Fate::kRight;
}

}  // namespace pointflight
