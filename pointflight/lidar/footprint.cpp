#include "pointflight/lidar/footprint.hpp"

#include "pointflight/core/constants.hpp"

namespace pointflight {
namespace {

constexpr double kFwhmPerSigma = 2.3548;  // 2 sqrt(2 ln 2)

}  // namespace

Footprint::Footprint(const OpticsSettings& optics)
    : sub_rays_(static_cast<std::size_t>(optics.sub_rays)),
      sigma_across_(static_cast<float>(optics.divergence_horizontal_deg * kDegree / kFwhmPerSigma)),
      sigma_up_(static_cast<float>(optics.divergence_vertical_deg * kDegree / kFwhmPerSigma)),
      merge_(static_cast<float>(0.5 * kLightSpeed * 1e-9 * optics.pulse_ns)) {
  if (sigma_across_ <= 0.0f && sigma_up_ <= 0.0f) sub_rays_ = 1;
}

WideBeams Footprint::beams(std::span<const Vector3f> across,
                           const EchoReceiver& receiver,
                           std::span<Echoes> echoes) const {
  return {.across = across,
          .sigma_across = sigma_across_,
          .sigma_up = sigma_up_,
          .merge = merge_,
          .sub_rays = sub_rays_,
          .receiver = &receiver,
          .echoes = echoes};
}

}  // namespace pointflight
