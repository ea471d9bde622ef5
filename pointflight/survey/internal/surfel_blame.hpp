// What rays that are rendered wrong say about the surfels that had a part in it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "pointflight/map/surfel_map.hpp"
#include "pointflight/render/internal/all_hits_kernel.hpp"
#include "pointflight/survey/internal/ray_fate.hpp"
#include "pointflight/survey/internal/reshaped_surfel.hpp"
#include "pointflight/survey/map_fit.hpp"
#include "pointflight/survey/surfel_evidence.hpp"

namespace pointflight {

/// Sums of evidence for and against the size and position of each surfel of a map, along each of
/// its axes (`fit_map`, pass 2). 128 bytes per word of the map.
class SurfelBlame {
 public:
  /// `map` and `fit` must outlive it.
  SurfelBlame(const SurfelMap& map, const FitOptions& fit);

  /// A surfel's part in a ray that is rendered early, right, or leaks. From any thread.
  void add(const SurveyRay& ray, Fate fate, const SurfelHit& hit);

  /// What becomes of the surfel, nothing if it is to go: it only causes early returns. One that had
  /// a part in no ray stays as it is.
  [[nodiscard]] std::optional<Reshaping> verdict(std::size_t word) const;

 private:
  /// Derivatives of a hit's weight, by ln s_k and by the centre's position along axis k in units
  /// of s_k.
  struct Slopes {
    std::array<double, 3> by_size;
    std::array<double, 3> by_position;
  };
  [[nodiscard]] Slopes slopes(const SurveyRay& ray, const SurfelHit& hit) const;
  [[nodiscard]] double size_factor(std::size_t word, std::size_t axis) const;
  [[nodiscard]] double shift(std::size_t word, std::size_t axis) const;

  const SurfelMap& map_;
  const FitOptions& fit_;
  double support_squared_;
  std::vector<std::uint8_t> headers_;  ///< Of each word, how far back its leaf's header lies.
  SurfelEvidence sums_;
};

}  // namespace pointflight
