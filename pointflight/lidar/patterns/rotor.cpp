#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/patterns/patterns.hpp"

namespace pointflight {
namespace {

/// Livox Mid-360 (constants fitted to the vendor's published table; mean error 0.005 deg, max
/// 0.015).
///
/// In the rotor's frame (T tangential, R radial, K along the shaft) the lasers are fixed in the
/// housing; light passes a slow wedge, then the rotor's prism and mirror.
class RotorPattern : public BeamPattern {
 public:
  explicit RotorPattern(const LidarSettings& settings)
      : s_(settings.rotor),
        train_(s_.shot_rate, from_seconds(s_.shot_phase / s_.shot_rate), settings.rate) {
    for (const double angle : s_.line_angles_deg) {
      lines_.push_back(math::sincos(angle * kDegree));
    }
  }

  [[nodiscard]] std::vector<Beam> beams(std::uint64_t scan_index,
                                        const Executor& executor) const override {
    const ShotTrain::Range range = train_.in_scan(scan_index);
    const auto shots = static_cast<std::size_t>(range.end - range.begin);
    std::vector<Beam> beams(shots * lines_.size());
    executor.parallel_for(shots, 512, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const SimTime time = train_.shots.at(range.begin + static_cast<std::int64_t>(i));
        fire(to_seconds(time), time - range.scan_start, &beams[i * lines_.size()]);
      }
    });
    return beams;
  }

 private:
  void fire(double t, Duration offset, Beam* beams) const {
    const auto theta = math::sincos(angle_at(s_.rotor_rpm / 60.0, t));
    const double phi = angle_at(s_.wedge_rpm / 60.0, t);
    const auto psi = math::sincos(phi + s_.wedge_wobble * math::sin(2.0 * phi) + s_.wedge_phase);
    const auto wedge = math::sincos(s_.wedge_angle_deg * kDegree);
    const auto mirror = math::sincos(s_.mirror_angle_deg * kDegree);
    const Vector3d inclined(-wedge.sin * psi.sin, -wedge.sin * psi.cos, wedge.cos);
    for (std::size_t line = 0; line < lines_.size(); ++line) {
      const math::SinCos fan = lines_[line];
      // (T, R, K): the fan in the housing, seen from the rotor
      const Vector3d b(fan.sin * theta.sin, fan.sin * theta.cos, fan.cos);
      const Vector3d glass = refract(b, Vector3d::UnitZ(), 1.0 / s_.wedge_index);
      const Vector3d air = refract(glass, inclined, s_.wedge_index);
      const double x = air.x();
      const double n2 = s_.mirror_index * s_.mirror_index;
      const double z = mirror.cos * air.y() +
                       mirror.sin * std::sqrt(std::max(0.0, n2 - x * x - air.y() * air.y()));
      const double y = -std::sqrt(std::max(0.0, 1.0 - x * x - z * z));
      const Vector3d direction(x * theta.cos + y * theta.sin, -x * theta.sin + y * theta.cos, z);
      beams[line] = {Vector3f::Zero(),
                     direction.normalized().cast<float>(),
                     offset,
                     static_cast<std::uint16_t>(line)};
    }
  }

  /// 2 pi times the fraction of a turn: exact for hours of running.
  static double angle_at(double turns_per_second, double t) {
    const double turns = turns_per_second * t;
    return 2.0 * kPi * (turns - std::floor(turns));
  }

  RotorSettings s_;
  ShotTrain train_;
  std::vector<math::SinCos> lines_;
};

}  // namespace

std::unique_ptr<BeamPattern> make_rotor_pattern(const LidarSettings& settings) {
  return std::make_unique<RotorPattern>(settings);
}

}  // namespace pointflight
