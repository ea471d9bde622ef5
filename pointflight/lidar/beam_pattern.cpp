#include "pointflight/lidar/beam_pattern.hpp"

#include <fmt/format.h>

#include <cmath>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/patterns/patterns.hpp"

namespace pointflight {

std::unique_ptr<BeamPattern> make_pattern(const LidarSettings& settings) {
  check_settings(settings, settings.path.empty() ? "lidar" : settings.path);
  struct Entry {
    ScanPattern pattern;
    std::unique_ptr<BeamPattern> (*make)(const LidarSettings& settings);
  };
  constexpr Entry kPatterns[] = {
      {ScanPattern::kRotor, make_rotor_pattern},
      {ScanPattern::kPrisms, make_prisms_pattern},
      {ScanPattern::kRings, make_rings_pattern},
      {ScanPattern::kGrid, make_grid_pattern},
      {ScanPattern::kCsv, make_csv_pattern},
  };
  for (const Entry& entry : kPatterns) {
    if (settings.pattern == entry.pattern) return entry.make(settings);
  }
  throw InputError(fmt::format("{}: pattern: none is set", settings.path));
}

std::int64_t ShotTrain::first_at_or_after(SimTime time) const {
  const double period = to_seconds(shots.at(1000000) - shots.at(0)) * 1e-6;
  auto n = static_cast<std::int64_t>(to_seconds(time - shots.at(0)) / period);
  while (n > 0 && shots.at(n - 1) >= time) --n;
  while (n < 0 || shots.at(n) < time) ++n;
  return n;
}

ShotTrain::Range ShotTrain::in_scan(std::uint64_t scan_index) const {
  const auto k = static_cast<std::int64_t>(scan_index);
  const SimTime start = scans.at(k);
  return {first_at_or_after(start), first_at_or_after(scans.at(k + 1)), start};
}

Vector3d direction_of(double azimuth, double elevation) {
  const auto a = math::sincos(azimuth);
  const auto e = math::sincos(elevation);
  return {e.cos * a.cos, e.cos * a.sin, e.sin};
}

Vector3d refract(const Vector3d& direction, const Vector3d& normal, double ratio) {
  const double c = direction.dot(normal);
  const double radicand = 1.0 - ratio * ratio * (1.0 - c * c);
  if (radicand < 0.0) return Vector3d::Zero();
  return ratio * direction + (std::sqrt(radicand) - ratio * c) * normal;
}

}  // namespace pointflight
