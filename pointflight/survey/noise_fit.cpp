#include "pointflight/survey/noise_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/lidar/return_model.hpp"
#include "pointflight/survey/median.hpp"

namespace pointflight {
namespace {

constexpr int kPasses = 20;
constexpr int kOpenPasses = 3;            // in which all patches count
constexpr std::size_t kParts = 3;         // of the variance
constexpr double kLeastVariance = 1e-10;  // m^2
constexpr double kOfPlane = 3.0;          // a plane takes so many points

using Parts = Eigen::Vector3d;

Parts parts_of(const NoiseSample& sample) {
  return {1.0, sample.lever * sample.lever, sample.weakness};
}

/// The least squares of A theta = b without negative parts: the best of all choices of parts that
/// are 0, of which there are eight.
Parts best_parts(const Eigen::Matrix3d& a, const Parts& b) {
  Parts best = Parts::Zero();
  double least = 0.0;  // of theta' A theta - 2 b' theta
  for (unsigned chosen = 1; chosen < 1u << kParts; ++chosen) {
    Eigen::Matrix3d reduced = Eigen::Matrix3d::Identity();
    Parts right = Parts::Zero();
    for (unsigned i = 0; i < kParts; ++i) {
      if ((chosen >> i & 1u) == 0) continue;
      right[i] = b[i];
      for (unsigned k = 0; k < kParts; ++k) {
        if ((chosen >> k & 1u) != 0) reduced(i, k) = a(i, k);
      }
    }
    const Parts found = reduced.fullPivLu().solve(right);
    if (!found.allFinite() || found.minCoeff() < 0.0) continue;
    const double cost = found.dot(a * found) - 2.0 * b.dot(found);
    if (cost >= least) continue;
    least = cost;
    best = found;
  }
  return best;
}

/// Sums of one pass, each column in units of its own so that they can be solved.
struct Sums {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Parts b = Parts::Zero();
  Parts scale = Parts::Ones();
  double count = 0.0;
  double misfit = 0.0;  ///< Sum of squares by what they are expected to be.
};

Sums sums_of(std::span<const NoiseSample> samples,
             const NoiseFit& fit,
             double not_flat,
             bool is_open) {
  Sums sums;
  sums.scale = Parts::Zero();
  for (const NoiseSample& sample : samples) sums.scale = sums.scale.cwiseMax(parts_of(sample));
  for (unsigned i = 0; i < kParts; ++i) {
    if (sums.scale[i] <= 0.0) sums.scale[i] = 1.0;
  }
  for (const NoiseSample& sample : samples) {
    const double expected = std::max(fit.variance(sample), kLeastVariance);
    if (sample.variance > not_flat * expected && !is_open) continue;
    const Parts x = parts_of(sample).cwiseQuotient(sums.scale);
    // of a variance of so many normal numbers
    const double weight = std::max(1.0, sample.points - kOfPlane) / (2.0 * expected * expected);
    // a patch that is not flat would rule the first passes
    const double variance = std::min(sample.variance, not_flat * expected);
    sums.a += weight * x * x.transpose();
    sums.b += weight * variance * x;
    sums.misfit += weight * (variance - expected) * (variance - expected);
    sums.count += 1.0;
  }
  return sums;
}

FittedSigma sigma_of(double variance, double error) {
  const double sigma = std::sqrt(std::max(0.0, variance));
  // of a variance that is near 0 the root of the error itself
  return {sigma,
          sigma > 0.0 ? std::min(error / (2.0 * sigma), std::sqrt(error)) : std::sqrt(error)};
}

}  // namespace

double NoiseFit::variance(const NoiseSample& at) const {
  return range.sigma * range.sigma + at.lever * at.lever * angle.sigma * angle.sigma +
         at.weakness * at_limit.sigma * at_limit.sigma;
}

NoiseFit fit_noise(std::span<const NoiseSample> samples, double not_flat) {
  require_argument(!samples.empty(), "fit_noise: a sample at least is wanted");
  std::vector<double> variances;
  variances.reserve(samples.size());
  for (const NoiseSample& sample : samples) variances.push_back(sample.variance);
  NoiseFit fit;
  fit.range.sigma = std::sqrt(median(variances));
  for (int pass = 0; pass < kPasses; ++pass) {
    const Sums sums = sums_of(samples, fit, not_flat, pass < kOpenPasses);
    const Parts found = best_parts(sums.a, sums.b).cwiseQuotient(sums.scale);
    // patches scatter by more than their points say: walls are uneven
    const double scatter = std::max(1.0, sums.misfit / std::max(1.0, sums.count - 3.0));
    Eigen::Matrix3d regular = sums.a;
    for (unsigned i = 0; i < kParts; ++i) {
      if (regular(i, i) <= 0.0) regular(i, i) = std::numeric_limits<double>::min();
    }
    const Eigen::Matrix3d covariance = scatter * regular.fullPivLu().inverse();
    const auto error = [&](unsigned i) {
      const double squared = covariance(i, i);
      return squared > 0.0 && std::isfinite(squared) ? std::sqrt(squared) / sums.scale[i]
                                                     : std::numeric_limits<double>::infinity();
    };
    fit.range = sigma_of(std::max(found[0], kLeastVariance), error(0));
    fit.angle = sigma_of(found[1], error(1));
    fit.at_limit = sigma_of(found[2], error(2));
  }
  return fit;
}

double signal_weakness(const DetectionModel& model, double range, double cosine) {
  if (model.is_ideal() || !(range > 0.0)) return 0.0;
  static const std::array<double, 32> reflectivities = [] {
    std::array<double, 32> quantiles{};
    for (std::size_t i = 0; i < quantiles.size(); ++i) {
      const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(quantiles.size());
      quantiles[i] = std::min(
          1.0, kUsualReflectivity * math::exp(kUsualSpread * math::normal_quantile(share)));
    }
    return quantiles;
  }();
  double weakness = 0.0;
  double seen = 0.0;
  for (const double reflectivity : reflectivities) {
    const double margin = model.margin(reflectivity * cosine, range);
    if (!(margin > 0.0)) continue;
    const double probability = model.probability(margin);
    seen += probability;
    weakness += probability / (margin * margin);
  }
  return seen > 0.0 ? weakness / seen : 0.0;
}

}  // namespace pointflight
