// What the noise of flat patches says of a sensor's noise of ranges, of directions and of weak
// signals.
#pragma once

#include <span>

#include "pointflight/lidar/detection.hpp"

namespace pointflight {

/// What a flat patch shows.
struct NoiseSample {
  double variance = 0.0;  ///< Of ranges about its plane, m^2.
  double lever = 0.0;     ///< Range times the tangent of the incidence, m.
  double weakness = 0.0;  ///< `signal_weakness` there.
  double points = 0.0;    ///< On it.
};

/// A figure and its standard error. Where it is not above twice its error it does not show.
struct FittedSigma {
  double sigma = 0.0;  ///< Standard deviation.
  double error = 0.0;  ///< Of `sigma`; of one that is 0, what it would have to be to show.
  /// True if it is there for sure.
  [[nodiscard]] bool shows() const { return sigma > 2.0 * error; }
};

/// s^2 = range^2 + (lever angle)^2 + weakness at_limit^2.
struct NoiseFit {
  FittedSigma range;     ///< m
  FittedSigma angle;     ///< rad
  FittedSigma at_limit;  ///< m, `RangeNoiseSettings::range_sigma_at_limit`.
  /// What a patch should show, m^2.
  [[nodiscard]] double variance(const NoiseSample& at) const;
};

/// Fits it by weighted least squares with no negative part, each patch by how well its own variance
/// is known; patches that show more than `not_flat` times what is fitted count as that. At least
/// one sample.
NoiseFit fit_noise(std::span<const NoiseSample> samples, double not_flat);

/// Mean of 1 / margin^2 over signals that come back from unknown surfaces (`kUsualReflectivity`,
/// `kUsualSpread`) at a range (m) and a cosine of the incidence: the jitter of ranges goes with it.
/// 0 if the model is ideal.
double signal_weakness(const DetectionModel& model, double range, double cosine);

}  // namespace pointflight
