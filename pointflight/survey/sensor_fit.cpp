#include "pointflight/survey/sensor_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/floor.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/survey/median.hpp"

namespace pointflight {
namespace {

constexpr double kTooNear = 0.05;         // m: drivers put what did not come back at zero
constexpr std::size_t kLeastPoints = 40;  // of a patch
constexpr std::size_t kLeastPatches = 30;
constexpr double kOnPlane = 0.9;      // of a patch's points, at least
constexpr double kOutlier = 4.0;      // deviations
constexpr double kNoisiest = 0.05;    // of its range: what scatters more is no surface
constexpr double kNotFlat = 2.5;      // times the variance that the noise explains
constexpr double kSteepest = 1.4;     // rad of incidence: beyond, planes tell ranges no more
constexpr double kRingsWidth = 10.0;  // deg, of patches that tell rings' offsets
constexpr double kMadPerSigma = 0.67449;
constexpr std::array<double, 13> kRanges = {0, 1, 2, 4, 6, 8, 10, 15, 20, 30, 50, 80, 1000};
constexpr std::array<double, 7> kIncidences = {0, 20, 40, 55, 65, 75, 90};  // deg
constexpr std::array<double, 5> kWidths = {1.0, 2.0, 3.0, 5.0, 8.0};        // deg, of patches

/// A return with what the fit needs of it.
struct Sight {
  Vector3f direction;
  float range;
  std::uint32_t scan;
  std::int32_t ring;
};

/// Sights in one cell of directions that lie on one plane.
struct Patch {
  double range = 0.0;                                       ///< At its middle, m.
  double incidence = 0.0;                                   ///< There, rad.
  double variance = 0.0;                                    ///< Of ranges about the plane, m^2.
  std::vector<std::pair<std::uint32_t, double>> residuals;  ///< Sight and range off the plane.
};

struct PlaneFit {
  Eigen::Vector3d c;  ///< 1 / range over d·m, linear in the position across the middle direction.
  bool is_firm = false;  ///< It is fixed in both directions.
};

PlaneFit fit_plane(const std::vector<Eigen::Vector3d>& places,
                   const std::vector<double>& values,
                   const std::vector<char>& used,
                   double width) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (used[i] == 0) continue;
    a += places[i] * places[i].transpose();
    b += places[i] * values[i];
    count += 1.0;
  }
  PlaneFit fit;
  // the spread across the narrow direction, in cell widths: one ring alone fixes no plane
  const Eigen::Vector2d mean = a.block<2, 1>(1, 0) / count;
  const Eigen::Matrix2d spread = a.block<2, 2>(1, 1) / count - mean * mean.transpose();
  const double half = 0.5 * (spread(0, 0) + spread(1, 1));
  const double apart = 0.5 * (spread(0, 0) - spread(1, 1));
  const double least = half - std::sqrt(apart * apart + spread(0, 1) * spread(0, 1));
  if (!(least > 0.01 * width * width)) return fit;
  fit.c = a.ldlt().solve(b);
  fit.is_firm = fit.c.allFinite() && fit.c[0] > 0.0;
  return fit;
}

/// The plane of a cell's sights, if they lie on one. `width` of the cell, rad.
std::optional<Patch> patch_of(std::span<const Sight> sights,
                              std::span<const std::uint32_t> members,
                              double width) {
  const std::size_t n = members.size();
  if (n < kLeastPoints) return std::nullopt;
  Vector3d middle = Vector3d::Zero();
  for (const std::uint32_t i : members) middle += sights[i].direction.cast<double>();
  middle.normalize();
  const Vector3d across =
      middle.cross(std::abs(middle.z()) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitX()).normalized();
  const Vector3d up = across.cross(middle);
  std::vector<Eigen::Vector3d> places(n);
  std::vector<double> values(n);
  std::vector<double> residuals(n);
  for (std::size_t k = 0; k < n; ++k) {
    const Vector3d d = sights[members[k]].direction.cast<double>();
    const double along = d.dot(middle);
    places[k] = {1.0, d.dot(across) / along, d.dot(up) / along};
    values[k] = 1.0 / (static_cast<double>(sights[members[k]].range) * along);
  }
  std::vector<char> used(n, 1);
  PlaneFit plane;
  std::size_t kept = n;
  for (int pass = 0; pass < 6; ++pass) {
    plane = fit_plane(places, values, used, width);
    if (!plane.is_firm) return std::nullopt;
    std::vector<double> sizes;
    for (std::size_t k = 0; k < n; ++k) {
      const double along = 1.0 / places[k].norm();
      const double inverse = plane.c.dot(places[k]) * along;
      if (!(inverse > 0.0)) return std::nullopt;
      residuals[k] = static_cast<double>(sights[members[k]].range) - 1.0 / inverse;
      sizes.push_back(std::abs(residuals[k]));
    }
    const double limit = kOutlier * median(sizes) / kMadPerSigma + 1e-9;
    kept = 0;
    for (std::size_t k = 0; k < n; ++k) {
      used[k] = std::abs(residuals[k]) <= limit ? 1 : 0;
      kept += used[k];
    }
    if (static_cast<double>(kept) < kOnPlane * static_cast<double>(n)) return std::nullopt;
  }
  Patch patch;
  const Vector3d normal = plane.c[0] * middle + plane.c[1] * across + plane.c[2] * up;
  patch.range = 1.0 / plane.c[0];
  patch.incidence = math::acos(std::min(1.0, normal.dot(middle) / normal.norm()));
  if (patch.incidence > kSteepest) return std::nullopt;
  double squares = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    if (used[k] == 0) continue;
    squares += residuals[k] * residuals[k];
    patch.residuals.emplace_back(members[k], residuals[k]);
  }
  patch.variance = squares / static_cast<double>(kept - 3);
  if (patch.variance > kNoisiest * kNoisiest * patch.range * patch.range) return std::nullopt;
  return patch;
}

/// All that lie on planes, in cells of so many degrees.
std::vector<Patch> patches_of(std::span<const Sight> sights,
                              double width,
                              const Executor& executor) {
  std::map<std::pair<std::int64_t, std::int64_t>, std::vector<std::uint32_t>> cells;
  for (std::uint32_t i = 0; i < sights.size(); ++i) {
    const Vector3d d = sights[i].direction.cast<double>();
    const std::int64_t row = floor_to_integer(math::asin(std::clamp(d.z(), -1.0, 1.0)) / width);
    const double level = math::cos((static_cast<double>(row) + 0.5) * width);
    const double column = math::atan2(d.y(), d.x()) * std::max(level, 0.01) / width;
    cells[{row, floor_to_integer(column)}].push_back(i);
  }
  std::vector<const std::vector<std::uint32_t>*> lists;
  lists.reserve(cells.size());
  for (const auto& [place, members] : cells) lists.push_back(&members);
  std::vector<std::optional<Patch>> found(lists.size());
  executor.parallel_for(lists.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) found[i] = patch_of(sights, *lists[i], width);
  });
  std::vector<Patch> patches;
  for (auto& patch : found) {
    if (patch) patches.push_back(std::move(*patch));
  }
  return patches;
}

std::size_t points_on(const std::vector<Patch>& patches) {
  return std::accumulate(
      patches.begin(), patches.end(), std::size_t{0}, [](std::size_t sum, const Patch& p) {
        return sum + p.residuals.size();
      });
}

double lever_of(const Patch& patch) {
  return patch.range * math::sin(patch.incidence) / math::cos(patch.incidence);
}

NoiseSample sample_of(const Patch& patch, const DetectionModel& detection) {
  return {patch.variance,
          lever_of(patch),
          signal_weakness(detection, patch.range, math::cos(patch.incidence)),
          static_cast<double>(patch.residuals.size())};
}

/// Patches far above what is fitted are not flat.
NoiseFit fit_noise_of(std::vector<Patch>& patches, const DetectionModel& detection) {
  std::vector<NoiseSample> samples;
  samples.reserve(patches.size());
  for (const Patch& patch : patches) samples.push_back(sample_of(patch, detection));
  const NoiseFit noise = fit_noise(samples, kNotFlat);
  std::erase_if(patches, [&](const Patch& p) {
    return p.variance > kNotFlat * noise.variance(sample_of(p, detection));
  });
  return noise;
}

void fill_bins(const std::vector<Patch>& patches, const DetectionModel& detection, SensorFit& fit) {
  for (std::size_t r = 0; r + 1 < kRanges.size(); ++r) {
    for (std::size_t i = 0; i + 1 < kIncidences.size(); ++i) {
      NoiseBin bin;
      bin.range_from = kRanges[r];
      bin.range_to = kRanges[r + 1];
      bin.incidence_from = kIncidences[i] * kDegree;
      bin.incidence_to = kIncidences[i + 1] * kDegree;
      std::vector<double> variances;
      double fitted = 0.0;  // variances
      for (const Patch& patch : patches) {
        if (patch.range < bin.range_from || patch.range >= bin.range_to) continue;
        if (patch.incidence < bin.incidence_from || patch.incidence >= bin.incidence_to) continue;
        variances.push_back(patch.variance);
        bin.range += patch.range;
        bin.tangent += lever_of(patch) * lever_of(patch);
        bin.points += patch.residuals.size();
        fitted += fit.noise.variance(sample_of(patch, detection));
      }
      if (variances.size() < 3) continue;
      const auto count = static_cast<double>(variances.size());
      bin.patches = variances.size();
      bin.range /= count;
      bin.tangent = std::sqrt(bin.tangent / count);
      bin.sigma = std::sqrt(median(variances));
      bin.fitted = std::sqrt(fitted / count);
      if (bin.range_to > 100.0) bin.range_to = fit.range_max;
      fit.bins.push_back(bin);
    }
  }
}

/// What patches move from scan to scan, by what their noise explains.
double unrest_of(const std::vector<Patch>& patches, std::span<const Sight> sights) {
  double sum = 0.0;
  double count = 0.0;
  for (const Patch& patch : patches) {
    std::map<std::uint32_t, std::pair<double, double>> by_scan;
    for (const auto& [sight, residual] : patch.residuals) {
      auto& [total, n] = by_scan[sights[sight].scan];
      total += residual;
      n += 1.0;
    }
    if (by_scan.size() < 3) continue;
    // the plane itself took three of them
    const double left = static_cast<double>(by_scan.size()) - 1.0;
    double squares = 0.0;
    for (const auto& [scan, mean] : by_scan) squares += mean.first * mean.first / mean.second;
    sum += squares / patch.variance;
    count += left;
  }
  return count > 0.0 ? std::sqrt(sum / count) : 0.0;
}

/// The coarsest step that ranges are whole multiples of, m.
double step_of(std::span<const Sight> sights) {
  for (const double step : {0.02, 0.01, 0.008, 0.005, 0.004, 0.003, 0.002, 0.001}) {
    double squares = 0.0;
    double count = 0.0;
    for (std::size_t i = 0; i < sights.size(); i += 1 + sights.size() / 20000) {
      const auto range = static_cast<double>(sights[i].range);
      if (range > 50.0) continue;  // float32 is too coarse there
      const double off = range / step - static_cast<double>(floor_to_integer(range / step + 0.5));
      squares += off * off;
      count += 1.0;
    }
    // 0.29 if they are not
    if (count > 1000.0 && std::sqrt(squares / count) < 0.05) return step;
  }
  return 0.0;
}

std::optional<double> rate_of(std::span<const RecordedScan> scans) {
  std::vector<double> periods;
  for (std::size_t i = 1; i < scans.size(); ++i) {
    const double period = scans[i].time - scans[i - 1].time;
    if (period > 0.0) periods.push_back(period);
  }
  if (periods.size() < 2) return std::nullopt;
  return 1.0 / median(periods);
}

/// Mean range off the planes of each ring.
void fill_range_offsets(const std::vector<Patch>& patches,
                        std::span<const Sight> sights,
                        TurnFit& turn) {
  std::map<std::int32_t, std::pair<double, double>> sums;
  for (const Patch& patch : patches) {
    for (const auto& [sight, residual] : patch.residuals) {
      auto& [sum, count] = sums[sights[sight].ring];
      sum += residual;
      count += 1.0;
    }
  }
  for (RingFit& ring : turn.rings) {
    const auto [sum, count] = sums[ring.ring];
    if (count > 0.0) ring.range_offset = sum / count;
  }
}

/// How rings' offsets scatter.
FittedSigma ring_offset_of(const TurnFit& turn) {
  const auto count = static_cast<double>(turn.rings.size());
  if (count < 4.0) return {};
  double sum = 0.0;
  double squares = 0.0;
  for (const RingFit& ring : turn.rings) {
    sum += ring.range_offset;
    squares += ring.range_offset * ring.range_offset;
  }
  const double sigma = std::sqrt(std::max(0.0, squares - sum * sum / count) / (count - 1.0));
  return {sigma, sigma / std::sqrt(2.0 * (count - 1.0))};
}

}  // namespace

SensorFit fit_sensor(std::span<const RecordedScan> scans,
                     const Executor& executor,
                     const Progress& progress,
                     const DetectionSettings& rated,
                     double sun_klx) {
  SensorFit fit;
  fit.scans = scans.size();
  std::vector<Sight> sights;
  fit.range_min = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < scans.size(); ++k) {
    for (const RecordedPoint& point : scans[k].points) {
      const Vector3f position = point.position.cast<float>();
      const float range = position.norm();
      if (!(static_cast<double>(range) > kTooNear) || !std::isfinite(range)) continue;
      sights.push_back({position / range, range, static_cast<std::uint32_t>(k), point.ring});
      fit.range_min = std::min(fit.range_min, static_cast<double>(range));
      fit.range_max = std::max(fit.range_max, static_cast<double>(range));
    }
  }
  fit.points = sights.size();
  std::vector<Patch> patches;
  for (std::size_t i = 0; i < kWidths.size(); ++i) {
    const double width = kWidths[i];
    report(progress,
           "looking for flat patches",
           static_cast<double>(i) / static_cast<double>(kWidths.size()));
    std::vector<Patch> found = patches_of(sights, width * kDegree, executor);
    if (points_on(found) <= points_on(patches)) continue;
    patches = std::move(found);
    fit.patch_deg = width;
    // small patches are flatter ones
    if (2 * points_on(patches) > sights.size()) break;
  }
  if (patches.size() < kLeastPatches) {
    throw InputError(fmt::format(
        "{} scans with {} returns show {} flat patches; {} are needed: let the sensor stand still "
        "before walls, for more scans",
        scans.size(),
        sights.size(),
        patches.size(),
        kLeastPatches));
  }
  const DetectionModel detection(rated, sun_klx);
  fit.noise = fit_noise_of(patches, detection);
  fit.patches = patches.size();
  fit.on_patches = points_on(patches);
  fit.unrest = unrest_of(patches, sights);
  fill_bins(patches, detection, fit);
  fit.range_step = step_of(sights);
  fit.rate = rate_of(scans);
  report(progress, "looking at rings", 0.8);
  fit.turn = fit_turn(scans);
  if (fit.turn) {
    // over two or three rings a plane takes any offset of one as its slope
    std::vector<Patch> wide = patches_of(sights, kRingsWidth * kDegree, executor);
    std::erase_if(wide, [&](const Patch& p) {
      return p.variance > kNotFlat * fit.noise.variance(sample_of(p, detection));
    });
    fill_range_offsets(wide, sights, *fit.turn);
    fit.ring_offset = ring_offset_of(*fit.turn);
  }
  return fit;
}

}  // namespace pointflight
