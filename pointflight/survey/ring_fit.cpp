#include "pointflight/survey/ring_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/survey/median.hpp"

namespace pointflight {
namespace {

constexpr double kOnAxis = 0.05;              // m from the axis: no azimuth
constexpr double kLongestApart = 0.02;        // s between points of a ring that tell its pace
constexpr double kLevelRing = 0.5 * kDegree;  // median distance of its points from its elevation

double azimuth_of(const RecordedPoint& point) {
  return math::atan2(point.position.y(), point.position.x());
}

/// Points of one ring of one scan, by time.
using RingPoints = std::map<std::int32_t, std::vector<const RecordedPoint*>>;

RingPoints rings_of(const RecordedScan& scan) {
  RingPoints rings;
  for (const RecordedPoint& point : scan.points) {
    const double level = std::hypot(point.position.x(), point.position.y());
    if (point.ring < 0 || !std::isfinite(point.time) || !(level > kOnAxis)) continue;
    rings[point.ring].push_back(&point);
  }
  for (auto& [number, points] : rings) {
    std::stable_sort(
        points.begin(), points.end(), [](const RecordedPoint* a, const RecordedPoint* b) {
          return a->time < b->time;
        });
  }
  return rings;
}

struct Pace {
  double slope = 0.0;  ///< rad/s, counter-clockwise.
  double cycle = 0.0;  ///< s
};

/// Azimuth less what the head has turned by then, circular mean of a ring in a scan.
double phase_of(const std::vector<const RecordedPoint*>& points, const Pace& pace, double zero) {
  double s = 0.0;
  double c = 0.0;
  for (const RecordedPoint* p : points) {
    const auto angle = math::sincos(wrap_angle(azimuth_of(*p) - pace.slope * (p->time - zero)));
    s += angle.sin;
    c += angle.cos;
  }
  return math::atan2(s, c);
}

/// The slope over whole scans, from one that is right within a turn of a scan.
void refine(Pace& pace, const std::vector<RingPoints>& scans) {
  for (int pass = 0; pass < 3; ++pass) {
    std::vector<double> corrections;
    for (const RingPoints& rings : scans) {
      for (const auto& [number, points] : rings) {
        if (points.size() < 20) continue;
        const double zero = 0.5 * (points.front()->time + points.back()->time);
        const double phase = phase_of(points, pace, zero);
        double xy = 0.0;
        double xx = 0.0;
        for (const RecordedPoint* p : points) {
          const double x = p->time - zero;
          xy += x * wrap_angle(azimuth_of(*p) - pace.slope * x - phase);
          xx += x * x;
        }
        if (xx > 0.0) corrections.push_back(xy / xx);
      }
    }
    if (corrections.empty()) return;
    pace.slope += median(corrections);
  }
}

/// How azimuths go on with time within a ring; nothing if they do not do so evenly.
std::optional<Pace> pace_of(const std::vector<RingPoints>& scans) {
  constexpr std::size_t kApart = 10;  // so that directions' noise is little of what was turned
  std::vector<double> slopes;
  std::vector<double> gaps;
  for (const RingPoints& rings : scans) {
    for (const auto& [number, points] : rings) {
      for (std::size_t i = 1; i < points.size(); ++i) {
        const double gap = points[i]->time - points[i - 1]->time;
        if (gap > 1e-7) gaps.push_back(gap);
        if (i < kApart) continue;
        const RecordedPoint& before = *points[i - kApart];
        const double apart = points[i]->time - before.time;
        if (!(apart > 1e-6) || apart > kLongestApart) continue;
        slopes.push_back(wrap_angle(azimuth_of(*points[i]) - azimuth_of(before)) / apart);
      }
    }
  }
  if (slopes.size() < 100) return std::nullopt;
  Pace pace;
  pace.slope = median(slopes);
  std::vector<double> off;
  off.reserve(slopes.size());
  for (const double slope : slopes) off.push_back(std::abs(slope - pace.slope));
  if (!(median(off) < 0.05 * std::abs(pace.slope))) return std::nullopt;  // no turning head
  refine(pace, scans);
  // most neighbours are one cycle apart, some more; times are rounded
  std::sort(gaps.begin(), gaps.end());
  const double least = gaps[gaps.size() / 20];
  double sum = 0.0;
  double cycles = 0.0;
  for (const double gap : gaps) {
    const double count = std::floor(gap / least + 0.5);
    if (count > 1.0) break;
    sum += gap;
    cycles += count;
  }
  pace.cycle = sum / cycles;
  return pace;
}

/// Of each ring against the first: where it looks, and when it fires.
struct RingSamples {
  std::vector<double> elevations, azimuths, times;
  std::size_t points = 0;
};

/// When a point's ring fires after the other's, within half a cycle either way; nothing if the
/// other has no point about then.
std::optional<double> lag_of(const RecordedPoint& point,
                             const std::vector<const RecordedPoint*>& others,
                             double cycle) {
  const auto after = std::lower_bound(
      others.begin(), others.end(), point.time - 0.5 * cycle, [](const auto* p, double time) {
        return p->time < time;
      });
  if (after == others.end() || (*after)->time > point.time + 0.5 * cycle) return std::nullopt;
  return point.time - (*after)->time;
}

void add_samples(const RingPoints& rings,
                 const Pace& pace,
                 std::map<std::int32_t, RingSamples>& samples) {
  if (rings.empty()) return;
  const auto& reference = rings.begin()->second;
  const double zero = reference.front()->time;
  const double phase = phase_of(reference, pace, zero);
  for (const auto& [number, points] : rings) {
    RingSamples& of_ring = samples[number];
    of_ring.points += points.size();
    of_ring.azimuths.push_back(wrap_angle(phase_of(points, pace, zero) - phase));
    for (const RecordedPoint* p : points) {
      of_ring.elevations.push_back(math::atan2(
          static_cast<double>(p->position.z()),
          std::hypot(static_cast<double>(p->position.x()), static_cast<double>(p->position.y()))));
      if (const auto lag = lag_of(*p, reference, pace.cycle)) of_ring.times.push_back(*lag);
    }
  }
}

/// Mean of times that are known but for whole cycles, 0 to before `cycle`.
double within_cycle(const std::vector<double>& times, double cycle) {
  double s = 0.0;
  double c = 0.0;
  for (const double time : times) {
    const auto angle = math::sincos(2.0 * kPi * time / cycle);
    s += angle.sin;
    c += angle.cos;
  }
  const double share = math::atan2(s, c) / (2.0 * kPi);
  return cycle * (share < -1e-9 ? share + 1.0 : std::max(share, 0.0));
}

/// A cycle begins after its longest pause: nothing else tells which ring is the first.
void start_after_the_pause(TurnFit& turn) {
  std::vector<double> times;
  times.reserve(turn.rings.size());
  for (const RingFit& ring : turn.rings) times.push_back(ring.fire_time_us);
  std::sort(times.begin(), times.end());
  double first = times.front();
  double longest = times.front() + turn.cycle_us - times.back();
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (times[i] - times[i - 1] <= longest) continue;
    longest = times[i] - times[i - 1];
    first = times[i];
  }
  for (RingFit& ring : turn.rings) {
    ring.fire_time_us -= first;
    // times that are one but for rounding stay one
    if (ring.fire_time_us < -1e-3) ring.fire_time_us += turn.cycle_us;
    ring.fire_time_us = std::max(ring.fire_time_us, 0.0);
  }
}

}  // namespace

std::optional<TurnFit> fit_turn(std::span<const RecordedScan> scans) {
  std::vector<RingPoints> rings;
  rings.reserve(scans.size());
  for (const RecordedScan& scan : scans) rings.push_back(rings_of(scan));
  const auto pace = pace_of(rings);
  if (!pace) return std::nullopt;
  std::map<std::int32_t, RingSamples> samples;
  const std::int32_t reference = rings.front().empty() ? -1 : rings.front().begin()->first;
  for (const RingPoints& of_scan : rings) {
    // each scan against one and the same ring
    if (!of_scan.empty() && of_scan.begin()->first == reference)
      add_samples(of_scan, *pace, samples);
  }
  if (samples.empty()) return std::nullopt;
  TurnFit turn;
  turn.rate = std::abs(pace->slope) / (2.0 * kPi);
  turn.is_clockwise = pace->slope < 0.0;
  turn.cycle_us = 1e6 * pace->cycle;
  for (auto& [number, of_ring] : samples) {
    RingFit ring;
    ring.ring = number;
    ring.points = of_ring.points;
    ring.elevation_deg = median(of_ring.elevations) / kDegree;
    std::vector<double> off;
    off.reserve(of_ring.elevations.size());
    for (const double e : of_ring.elevations)
      off.push_back(std::abs(e - ring.elevation_deg * kDegree));
    // a Mid-360's azimuths go round evenly as well, but up and down meanwhile
    if (median(off) > kLevelRing) return std::nullopt;
    ring.azimuth_offset_deg = median(of_ring.azimuths) / kDegree;
    ring.fire_time_us = 1e6 * within_cycle(of_ring.times, pace->cycle);
    turn.rings.push_back(ring);
  }
  start_after_the_pause(turn);
  return turn;
}

std::string rings_csv(const TurnFit& turn) {
  std::string text = "ring,elevation_deg,azimuth_offset_deg,fire_time_us\n";
  for (const RingFit& ring : turn.rings) {
    text += fmt::format("{},{},{},{}\n",
                        ring.ring,
                        fixed_text(ring.elevation_deg, 3),
                        fixed_text(ring.azimuth_offset_deg, 3),
                        fixed_text(ring.fire_time_us, 3));
  }
  return text;
}

}  // namespace pointflight
