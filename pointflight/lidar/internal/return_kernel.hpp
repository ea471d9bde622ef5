// Which signals a sensor reports and at which range, many at a time.
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace pointflight {

/// Figures of a sensor in its surroundings: of `DetectionModel` and `RangeNoiseSettings`.
struct SignalFigures {
  std::span<const double> log_ranges;          ///< None: whatever is hit comes back.
  std::span<const double> log_reflectivities;  ///< As many.
  std::span<const double> near_ranges;         ///< May be none.
  std::span<const double> near_shares;         ///< As many.
  double threshold = 0.0;                      ///< `DetectionModel::probability`: T
  double slope = 0.0;                          ///< T + z
  double range_sigma = 0.0;                    ///< m
  double range_sigma_per_m2 = 0.0;             ///< 1/m
  double range_sigma_at_limit = 0.0;           ///< m
  double range_step = 0.0;                     ///< m; 0: ranges are not rounded
};

inline constexpr double kNearestSignal = 0.01;  ///< m: those from nearer are as strong.

/// Some signals, each an entry of every array. Large, and set where it is used: not cleared.
// NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): written before it is read
struct SignalBlock {
  static constexpr std::size_t kMost = 256;
  std::size_t count = 0;
  alignas(64) std::array<double, kMost> range;         ///< m
  alignas(64) std::array<double, kMost> reflectivity;  ///< What is left of it behind the air.
  alignas(64) std::array<double, kMost> normal;        ///< Standard normal
  alignas(64) std::array<double, kMost> detection;     ///< Uniform in [0, 1)
  alignas(64) std::array<float, kMost> measured;       ///< Result, m; negative: not detected.
};

/// Sets `measured`, and entries behind the last signal to anything: the same bits with every
/// instruction set.
void measure_signals(const SignalFigures& figures, SignalBlock& block);

}  // namespace pointflight
