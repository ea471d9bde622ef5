#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "pointflight/map/surfel.hpp"

namespace pointflight {

/// One surfel that a beam meets.
struct SurfelHit {
  float t;              ///< Where the beam passes the surfel's middle, m along the beam.
  float weight;         ///< Kernel weight; those of a fully covered plane average 1.
  SurfelWord word;      ///< Breaks ties of t, so that no order of visiting shows.
  std::uint32_t index;  ///< Of the word in the map.
};

/// Where the coverage rule sees a surface.
struct CoverageResult {
  float first;              ///< t of the first surfel of the surface.
  float range;              ///< Weighted mean of the surfels' t.
  std::uint32_t strongest;  ///< Word index of the surfel with the largest weight.
};

/// Surfels that one beam has met so far, and the hit rule over them.
class HitList {  // NOLINT(cppcoreguidelines-pro-type-member-init): hits_ up to size_ only
 public:
  static constexpr std::size_t kCapacity = 256;

  void clear() {
    size_ = 0;
    total_ = 0.0f;
    sorted_ = true;
  }
  [[nodiscard]] bool full() const { return size_ == kCapacity; }
  [[nodiscard]] bool empty() const { return size_ == 0; }

  /// Sum of all weights: below tau no surface can exist.
  [[nodiscard]] float total_weight() const { return total_; }
  [[nodiscard]] std::span<const SurfelHit> hits() const { return {hits_.data(), size_}; }

  void add(const SurfelHit& hit) {
    hits_[size_++] = hit;
    total_ += hit.weight;
    sorted_ = false;
  }

  /// Forgets all hits behind t.
  void drop_behind(float t);

  /// Forgets the farthest hit (the list is full and nothing lies behind the surface).
  void drop_farthest();

  /// The hit rule (docs/architecture.md, "Hit rule"): sorted by (t, word), the first hit a for
  /// which the weights within [t_a, t_a + window] reach tau makes the return.
  std::optional<CoverageResult> evaluate(float tau, float window);

 private:
  void sort();

  std::array<SurfelHit, kCapacity> hits_;
  std::size_t size_ = 0;
  float total_ = 0.0f;
  bool sorted_ = true;
};

}  // namespace pointflight
