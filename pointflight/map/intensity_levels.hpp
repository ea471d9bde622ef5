#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace pointflight {

/// What the codes of a map's intensities stand for.
struct IntensityLevels {
  std::array<float, 256> of_code{};  ///< Ascending.
  bool is_linear = true;  ///< Equal steps; said by a map's header, else by a section of its own.
  float step = 0.0f;      ///< From one to the next, if they are equal.

  /// offset + step * code.
  static IntensityLevels linear(float offset, float step);
  /// Unless they are linear: up to where steps are equal.
  [[nodiscard]] float usual_end() const;
  /// The code of the nearest level.
  [[nodiscard]] std::uint8_t code_of(float intensity) const;
};

/// Chooses levels by the values that there are.
class IntensityHistogram {
 public:
  IntensityHistogram();
  /// A finite intensity.
  void add(float intensity);
  /// Nothing was added.
  [[nodiscard]] bool is_empty() const { return count_ == 0; }

  /// Linear from the least to the greatest value, unless a few outliers would take the steps from
  /// all others: if the greatest is more than twice as far from the least as 99.9 % of the values
  /// are, these have 240 equal steps, and what lies beyond has the others, growing by one ratio.
  [[nodiscard]] IntensityLevels levels() const;

 private:
  std::vector<std::uint64_t> counts_;  // by the first 16 bits of the number
  std::uint64_t count_ = 0;
  float least_, greatest_;
};

/// Name of the section of a map that has levels which are not linear: 256 floats.
inline constexpr char kLevelsSection[] = "levels";

}  // namespace pointflight
