// A stereo depth camera: what it measures is the disparity between two imagers.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/return_model.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// Makes depths of what the left imager sees. With d = f B / z (pixels; f: `GridSettings::fx`, B:
/// the baseline), a pixel in column u has no depth if
/// - its position in the right image, u - d, lies outside of that: a band of d columns on the left,
/// - something nearer hides it from the right imager: a shadow on the left of what stands in front,
/// - d is more than `StereoSettings::disparities`, or the surface is seen at a grazing angle,
/// - the depth lies beyond the camera's limits.
/// Else d gets noise, part of it common to the pixels of a matching window, and is rounded to
/// 1 / `disparity_steps`.
class StereoCamera {
 public:
  /// Of a sensor file with `grid.stereo`.
  explicit StereoCamera(const LidarSettings& lidar);

  /// How the camera's noise is drawn.
  struct Draws {
    const RandomStream& pixels;   ///< Two pixels each, index: image << 32 | the pair in its rows.
    const RandomStream& windows;  ///< Of the nodes between windows, index: image << 32 | node.
    std::uint64_t image = 0;      ///< Its number.
    bool noise = true;            ///< False: disparities are rounded and no more.
  };
  /// Depths (m along the axis) of the pixels, row by row from the top left: `hits` are of their
  /// rays, `shares` what each ray's range is to be multiplied by for the depth. Intensities are the
  /// map's. The result does not depend on the executor's threads.
  [[nodiscard]] std::vector<Return> measure(std::span<const Hit> hits,
                                            std::span<const float> shares,
                                            const Draws& draws,
                                            const Executor& executor) const;

 private:
  void measure_row(std::size_t row,
                   std::span<const Hit> hits,
                   std::span<const float> shares,
                   const Draws& draws,
                   std::span<const double> nodes,
                   std::span<Return> returns) const;
  [[nodiscard]] std::vector<double> nearest_in_right(std::span<const double> disparities) const;
  [[nodiscard]] std::vector<double> noise_of(std::size_t row,
                                             const Draws& draws,
                                             std::span<const double> nodes) const;

  StereoSettings stereo_;
  std::size_t columns_, rows_;
  double focal_baseline_;  ///< f B, px m.
  double range_min_, range_max_, depth_step_;
  double least_cosine_;
  std::size_t nodes_;  ///< In a row of the windows' grid, whose rows are a window apart.
};

}  // namespace pointflight
