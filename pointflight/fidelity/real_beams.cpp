#include "pointflight/fidelity/real_beams.hpp"

#include <algorithm>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"

namespace pointflight {
namespace {

constexpr double kLeastQuantile = 1e-3;

}  // namespace

double least_range_of(const std::vector<RealScan>& scans) {
  std::vector<float> ranges;
  for (const RealScan& scan : scans) {
    for (const SurveyRay& ray : scan.rays) ranges.push_back(ray.range);
  }
  if (ranges.empty()) return 0.0;
  const auto at = ranges.begin() +
                  static_cast<std::ptrdiff_t>(kLeastQuantile * static_cast<double>(ranges.size()));
  std::nth_element(ranges.begin(), at, ranges.end());
  return static_cast<double>(*at);
}

std::size_t DirectionCells::of(const Vector3f& direction_sensor) {
  const Vector3d d = direction_sensor.cast<double>();
  const double azimuth = math::atan2(d.y(), d.x()) / kDegree + 180.0;
  const double elevation = math::asin(std::clamp(d.z(), -1.0, 1.0)) / kDegree + 90.0;
  const auto column = std::min(static_cast<std::size_t>(azimuth / kSize), kColumns - 1);
  const auto row = std::min(static_cast<std::size_t>(elevation / kSize), kRows - 1);
  return row * kColumns + column;
}

BeamOrigins::BeamOrigins(const Lidar& lidar, std::size_t scans, const Executor& executor)
    : fired_(DirectionCells::kCount), origins_(DirectionCells::kCount, Vector3f::Zero()) {
  for (std::size_t i = 0; i < scans; ++i) {
    for (const Beam& beam : lidar.beams(lidar.pattern_scan(i, 0), executor)) {
      const std::size_t cell = DirectionCells::of(beam.direction_sensor);
      fired_[cell] += 1.0;
      origins_[cell] += beam.origin_sensor;
      beams_ += 1.0;
    }
  }
  for (std::size_t i = 0; i < fired_.size(); ++i) {
    if (fired_[i] > 0.0) origins_[i] /= static_cast<float>(fired_[i]);
  }
}

RealBeams BeamOrigins::of(const RealScan& scan) const {
  RealBeams real;
  for (std::size_t i = 0; i < scan.rays.size(); ++i) {
    const Vector3f point = scan.point_sensor(i);
    const Vector3f& origin = origins_[DirectionCells::of(point.normalized())];
    const Vector3f way = point - origin;
    real.origins_sensor.push_back(origin);
    real.ranges.push_back(way.norm());
    real.directions_sensor.push_back(way / real.ranges.back());
  }
  return real;
}

}  // namespace pointflight
