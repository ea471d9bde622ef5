#include "pointflight/picture/scan_statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <unordered_map>

#include "pointflight/core/constants.hpp"
#include "pointflight/lidar/beam_pattern.hpp"
#include "pointflight/lidar/blockage.hpp"

namespace pointflight::picture {
namespace {

BeamAngles angles_of(const Beam& beam) {
  const Vector3d d = beam.direction_sensor.cast<double>();
  return {static_cast<float>(std::atan2(d.y(), d.x()) / kDegree),
          static_cast<float>(std::asin(std::clamp(d.z(), -1.0, 1.0)) / kDegree)};
}

double angle_between_deg(const Beam& a, const Beam& b) {
  const double chord = static_cast<double>((a.direction_sensor - b.direction_sensor).norm());
  return 2.0 * std::asin(std::min(1.0, 0.5 * chord)) / kDegree;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Median distance to the nearest other direction, by cells of the cube around the unit sphere
/// that are as wide as the distance looked for; wider ones are tried until most have a neighbour.
double nearest_neighbour_deg(const std::vector<Beam>& beams) {
  const auto cell_of = [](const Vector3f& d, float side, int axis) {
    return static_cast<std::int64_t>(std::floor(d[axis] / side));
  };
  for (float side = 0.0005f; side < 4.0f; side *= 2.0f) {
    std::unordered_map<std::int64_t, std::vector<std::uint32_t>> cells;
    const auto key = [](std::int64_t x, std::int64_t y, std::int64_t z) {
      return ((x & 0x1fffff) << 42) | ((y & 0x1fffff) << 21) | (z & 0x1fffff);
    };
    for (std::uint32_t i = 0; i < beams.size(); ++i) {
      const Vector3f& d = beams[i].direction_sensor;
      cells[key(cell_of(d, side, 0), cell_of(d, side, 1), cell_of(d, side, 2))].push_back(i);
    }
    // some beams, all over the scan, stand for all
    const std::size_t stride = std::max<std::size_t>(1, beams.size() / 4000);
    std::vector<double> found;
    std::size_t asked = 0;
    for (std::size_t i = 0; i < beams.size(); i += stride) {
      ++asked;
      const Vector3f& d = beams[i].direction_sensor;
      float best = side;
      for (int n = 0; n < 27; ++n) {
        const auto cell = cells.find(key(cell_of(d, side, 0) + n % 3 - 1,
                                         cell_of(d, side, 1) + n / 3 % 3 - 1,
                                         cell_of(d, side, 2) + n / 9 - 1));
        if (cell == cells.end()) continue;
        for (const std::uint32_t j : cell->second) {
          if (j != i) best = std::min(best, (beams[j].direction_sensor - d).norm());
        }
      }
      if (best < side) found.push_back(2.0 * std::asin(0.5 * static_cast<double>(best)) / kDegree);
    }
    // what was not found is farther than all that was: the median is known from half on
    if (2 * found.size() > asked) {
      std::sort(found.begin(), found.end());
      return found[asked / 2];
    }
  }
  return 0.0;
}

/// Gaps between rings of one elevation each.
std::optional<std::pair<double, double>> ring_gaps(const std::vector<Beam>& beams) {
  constexpr double kFlat = 0.01;  // deg within which a ring has one elevation
  std::map<std::uint16_t, std::array<double, 2>> rings;
  for (const Beam& beam : beams) {
    const auto elevation = static_cast<double>(angles_of(beam).elevation_deg);
    const auto [ring, is_new] = rings.try_emplace(beam.ring, std::array{elevation, elevation});
    ring->second = {std::min(ring->second[0], elevation), std::max(ring->second[1], elevation)};
  }
  std::vector<double> elevations;
  for (const auto& [ring, range] : rings) {
    if (range[1] - range[0] > kFlat) return std::nullopt;
    elevations.push_back(0.5 * (range[0] + range[1]));
  }
  if (elevations.size() < 2) return std::nullopt;
  std::sort(elevations.begin(), elevations.end());
  std::pair gaps(360.0, 0.0);
  for (std::size_t i = 1; i < elevations.size(); ++i) {
    const double gap = elevations[i] - elevations[i - 1];
    gaps = {std::min(gaps.first, gap), std::max(gaps.second, gap)};
  }
  return gaps;
}

/// Calls `visit(beam, seconds)` for the beams of the first `duration` seconds.
template <class Visit>
void for_each_beam(const LidarSettings& settings, double duration, const Visit& visit) {
  const auto pattern = make_pattern(settings);
  const Executor executor;
  const Schedule scans(settings.rate);
  std::vector<Beam> beams;
  for (std::int64_t k = 0; to_seconds(scans.at(k)) < duration; ++k) {
    if (k == 0 || !pattern->repeats())
      beams = pattern->beams(static_cast<std::uint64_t>(k), executor);
    for (const Beam& beam : beams) {
      const double time = to_seconds(scans.at(k)) + to_seconds(beam.time_offset);
      if (time < duration) visit(beam, time);
    }
    // the same again adds nothing once a scan is over
    if (pattern->repeats()) return;
  }
}

}  // namespace

ScanStatistics scan_statistics(const LidarSettings& settings) {
  const Executor executor;
  const auto pattern = make_pattern(settings);
  const std::vector<Beam> beams = pattern->beams(0, executor);
  ScanStatistics s;
  s.beams = beams.size();
  if (beams.empty()) return s;
  // patterns that do not repeat differ from scan to scan by a shot
  const auto scans = static_cast<std::uint64_t>(
      pattern->repeats() ? 1.0 : std::clamp(std::floor(settings.rate), 1.0, 20.0));
  std::size_t counted = 0;
  for (std::uint64_t k = 0; k < scans; ++k) counted += pattern->beams(k, executor).size();
  s.beams_a_second = static_cast<double>(counted) * settings.rate / static_cast<double>(scans);
  s.azimuth_min = s.elevation_min = 360.0;
  s.azimuth_max = s.elevation_max = -360.0;
  const Blockage blockage(read_blocked_sectors(settings));
  std::map<std::uint16_t, const Beam*> before;
  std::vector<double> steps;
  Duration first = beams.front().time_offset;
  Duration last = first;
  for (const Beam& beam : beams) {
    const BeamAngles a = angles_of(beam);
    s.azimuth_min = std::min(s.azimuth_min, static_cast<double>(a.azimuth_deg));
    s.azimuth_max = std::max(s.azimuth_max, static_cast<double>(a.azimuth_deg));
    s.elevation_min = std::min(s.elevation_min, static_cast<double>(a.elevation_deg));
    s.elevation_max = std::max(s.elevation_max, static_cast<double>(a.elevation_deg));
    s.blocked += blockage.share(beam.direction_sensor) / static_cast<double>(beams.size());
    first = std::min(first, beam.time_offset);
    last = std::max(last, beam.time_offset);
    const Beam*& previous = before[beam.ring];
    if (previous != nullptr) steps.push_back(angle_between_deg(*previous, beam));
    previous = &beam;
  }
  s.rings = before.size();
  s.span = static_cast<double>((last - first).count()) / 1e9;  // exact: no 0.036000000000000004
  s.along_ring = median(std::move(steps));
  s.nearest = nearest_neighbour_deg(beams);
  s.between_rings = ring_gaps(beams);
  return s;
}

std::vector<BeamAngles> pattern_of(const LidarSettings& settings, double duration) {
  std::vector<BeamAngles> angles;
  for_each_beam(
      settings, duration, [&](const Beam& beam, double) { angles.push_back(angles_of(beam)); });
  return angles;
}

Coverage coverage_of(const LidarSettings& settings, double duration) {
  constexpr int kBins = 60;  // of time
  Coverage coverage;
  const auto columns = static_cast<std::size_t>(std::lround(360.0 / coverage.cell_deg));
  const auto rows = columns / 2;
  std::vector<std::uint8_t> first_hit(columns * rows, kBins);  // bin of time, or kBins
  for_each_beam(settings, duration, [&](const Beam& beam, double time) {
    const BeamAngles a = angles_of(beam);
    const auto x =
        static_cast<std::size_t>((static_cast<double>(a.azimuth_deg) + 180.0) / coverage.cell_deg);
    const auto y =
        static_cast<std::size_t>((static_cast<double>(a.elevation_deg) + 90.0) / coverage.cell_deg);
    auto& cell = first_hit[std::min(y, rows - 1) * columns + std::min(x, columns - 1)];
    cell = std::min(cell, static_cast<std::uint8_t>(time / duration * kBins));
  });
  std::array<double, kBins + 1> hit{};  // solid angle by the bin of its first beam
  double whole = 0.0;
  for (std::size_t x = 0; x < columns; ++x) {
    std::size_t low = 0;
    while (low < rows && first_hit[low * columns + x] == kBins) ++low;
    std::size_t high = rows;
    while (high > low && first_hit[(high - 1) * columns + x] == kBins) --high;
    for (std::size_t y = low; y < high; ++y) {
      const double area =
          std::cos(((static_cast<double>(y) + 0.5) * coverage.cell_deg - 90.0) * kDegree);
      whole += area;
      hit[first_hit[y * columns + x]] += area;
    }
  }
  double sum = 0.0;
  coverage.time.push_back(0.0);
  coverage.fraction.push_back(0.0);
  for (int bin = 0; bin < kBins; ++bin) {
    sum += hit[static_cast<std::size_t>(bin)];
    coverage.time.push_back(duration * (bin + 1) / kBins);
    coverage.fraction.push_back(whole > 0.0 ? sum / whole : 0.0);
  }
  return coverage;
}

}  // namespace pointflight::picture
