#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/patterns/patterns.hpp"

namespace pointflight {
namespace {

/// Livox Avia, Mid-40, Mid-70: light passes rotating wedges one after another (Brazeal et al.,
/// Sensors 21 (2021) 4722). A wedge's flat face has the normal (1, 0, 0).
class PrismsPattern : public BeamPattern {
 public:
  explicit PrismsPattern(const LidarSettings& settings)
      : s_(settings.prisms),
        train_(s_.shot_rate, from_seconds(s_.shot_phase / s_.shot_rate), settings.rate) {}

  [[nodiscard]] std::vector<Beam> beams(std::uint64_t scan_index,
                                        const Executor& executor) const override {
    const ShotTrain::Range range = train_.in_scan(scan_index);
    const auto shots = static_cast<std::size_t>(range.end - range.begin);
    const std::size_t lines = s_.line_heights.size();
    std::vector<Beam> beams(shots * lines);
    executor.parallel_for(shots, 512, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const SimTime time = train_.shots.at(range.begin + static_cast<std::int64_t>(i));
        fire(to_seconds(time), time - range.scan_start, &beams[i * lines]);
      }
    });
    return beams;
  }

 private:
  void fire(double t, Duration offset, Beam* beams) const {
    std::vector<Vector3d> light(s_.line_heights.size());
    for (std::size_t line = 0; line < light.size(); ++line) {
      const double height = s_.line_heights[line];
      light[line] = {std::sqrt(1.0 - height * height), 0.0, height};
    }
    for (const WedgeSettings& wedge : s_.wedges) {
      const double turns = wedge.rate * t + wedge.phase_deg / 360.0;
      const auto psi = math::sincos(2.0 * kPi * (turns - std::floor(turns)));
      const auto a = math::sincos(wedge.angle_deg * kDegree);
      const double side = wedge.flat_first ? a.sin : -a.sin;
      const Vector3d inclined(a.cos, side * psi.cos, side * psi.sin);
      const Vector3d flat = Vector3d::UnitX();
      for (Vector3d& b : light) {
        b = refract(b, wedge.flat_first ? flat : inclined, 1.0 / wedge.index);
        b = refract(b, wedge.flat_first ? inclined : flat, wedge.index);
      }
    }
    for (std::size_t line = 0; line < light.size(); ++line) {
      beams[line] = {Vector3f::Zero(),
                     light[line].normalized().cast<float>(),
                     offset,
                     static_cast<std::uint16_t>(line)};
    }
  }

  PrismsSettings s_;
  ShotTrain train_;
};

}  // namespace

std::unique_ptr<BeamPattern> make_prisms_pattern(const LidarSettings& settings) {
  return std::make_unique<PrismsPattern>(settings);
}

}  // namespace pointflight
