#include "pointflight/fidelity/sensor_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/fidelity/real_beams.hpp"
#include "pointflight/fidelity/sensor_lines.hpp"
#include "pointflight/geometry/internal/point_tree-inl.hpp"
#include "pointflight/lidar/lidar.hpp"

namespace pointflight {
namespace {

constexpr double kBlocked = 0.15;    // share of returns below which a direction is
constexpr double kMargin = 0.1;      // m, of what is too near
constexpr double kOffPlane = 0.3;    // m
constexpr double kLeastWidth = 0.1;  // deg, about lines
constexpr double kFwhmPerSigma = 2.3548;
constexpr std::chrono::seconds kApart{10};  // of scans: what is in the way differs
constexpr std::size_t kRim = 8;             // lines around a beam
constexpr double kBesideEdge = 0.03;        // rad
constexpr double kOffMap = 0.15;            // m: farther off is something else

/// Beams of one scan that were given.
class GivenBeams : public BeamPattern {
 public:
  explicit GivenBeams(std::vector<Beam> beams) : beams_(std::move(beams)) {}
  [[nodiscard]] std::vector<Beam> beams(std::uint64_t /*index*/,
                                        const Executor& /*executor*/) const override {
    return beams_;
  }
  [[nodiscard]] bool repeats() const override { return true; }

 private:
  std::vector<Beam> beams_;
};

template <class Limits>
std::size_t bin_of(const Limits& limits, double value) {
  const auto above = std::upper_bound(limits.begin(), limits.end(), value);
  return static_cast<std::size_t>(above - limits.begin());
}

/// The share that a hit belongs to; null if it counts for none.
ReturnShare* share_of(SensorComparison& made, const Hit& hit) {
  if (!hit.is_return() || static_cast<double>(hit.range) < made.least_range + kMargin) {
    return nullptr;
  }
  const std::size_t range = bin_of(SensorComparison::kRanges, static_cast<double>(hit.range));
  if (range == SensorComparison::kRanges.size()) return nullptr;
  const double cos = std::clamp(static_cast<double>(hit.cos_incidence), 0.0, 1.0);
  const std::size_t incidence =
      std::min(bin_of(SensorComparison::kIncidences, math::acos(cos) / kDegree),
               SensorComparison::kIncidences.size() - 1);
  return &made.shares[range - 1][incidence - 1];
}

/// How far real returns lie off the map where there is no edge: what noise, poses and map make of a
/// range.
class EvenErrors {
 public:
  EvenErrors(const RealBeams& real, const std::vector<Hit>& lines, const std::vector<bool>& edges)
      : tree_(even_directions(real, lines, edges)) {
    for (const std::size_t i : even_) errors_.push_back(error_of(real, lines, i));
  }

  /// Measured minus rendered range of the return that is nearest to a direction, m; 0 if none is
  /// near.
  [[nodiscard]] double beside(const Vector3f& direction_sensor) const {
    const auto near = tree_.within(direction_sensor.cast<double>(), kBesideEdge);
    return near.empty() ? 0.0 : errors_[near.front().index];
  }

 private:
  static double error_of(const RealBeams& real, const std::vector<Hit>& lines, std::size_t i) {
    return static_cast<double>(real.ranges[i] - lines[i].range);
  }
  std::vector<Vector3f> even_directions(const RealBeams& real,
                                        const std::vector<Hit>& lines,
                                        const std::vector<bool>& edges) {
    std::vector<Vector3f> directions;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (edges[i] || !lines[i].is_return()) continue;
      if (std::abs(error_of(real, lines, i)) > kOffMap) continue;
      even_.push_back(i);
      directions.push_back(real.directions_sensor[i]);
    }
    return directions;
  }

  std::vector<std::size_t> even_;
  PointTree<Vector3f> tree_;
  std::vector<double> errors_;
};

/// Counts the scans of one sensor into a comparison.
class Counter {
 public:
  Counter(const std::vector<RealScan>& scans,
          const LidarSettings& lidar,
          const Surroundings& surroundings,
          const Renderer& renderer,
          const Executor& executor)
      : scans_(scans),
        settings_(lidar),
        surroundings_(surroundings),
        renderer_(renderer),
        executor_(executor),
        modelled_(lidar, 0, nullptr, surroundings),
        origins_(modelled_, scans.size(), executor) {
    settings_.detection.returns = lidar.detection.returns == ReturnMode::kFirst ||
                                          lidar.detection.returns == ReturnMode::kLast
                                      ? lidar.detection.returns
                                      : ReturnMode::kStrongest;
    const double width = std::max({kLeastWidth,
                                   lidar.optics.divergence_horizontal_deg,
                                   lidar.optics.divergence_vertical_deg});
    radius_ = static_cast<float>(2.0 * width * kDegree / kFwhmPerSigma);
    made_.least_range = std::max(lidar.range_min, least_range_of(scans));
    find_blocked();
  }

  void add(std::size_t scan) {
    count_returns(scan);
    count_edges(scan);
  }

  [[nodiscard]] const SensorComparison& made() const { return made_; }

 private:
  /// Where next to nothing comes back, unless the sensor's file says what is in its way.
  void find_blocked() {
    std::vector<double> real(DirectionCells::kCount);
    for (const RealScan& scan : scans_) {
      for (const Vector3f& direction : origins_.of(scan).directions_sensor) {
        real[DirectionCells::of(direction)] += 1.0;
      }
      made_.returns += scan.rays.size();
    }
    made_.beams = origins_.beams();
    blocked_.resize(DirectionCells::kCount);
    if (!settings_.blocked.empty()) return;
    for (std::size_t i = 0; i < blocked_.size(); ++i) {
      blocked_[i] = real[i] < kBlocked * origins_.fired(i);
      if (blocked_[i]) made_.blocked += origins_.fired(i);
    }
  }

  [[nodiscard]] std::vector<Hit> lines(const Pose& T_world_sensor,
                                       std::span<const Vector3f> origins_sensor,
                                       std::span<const Vector3f> directions_sensor) const {
    const auto far = static_cast<float>(SensorComparison::kRanges.back());
    return render_lines(
        T_world_sensor, origins_sensor, directions_sensor, far, renderer_, executor_);
  }

  /// True if a line that comes back from whatever it hits within the sensor's range does.
  [[nodiscard]] bool is_seen(const Hit& hit) const {
    const auto range = static_cast<double>(hit.range);
    return range >= made_.least_range && range <= settings_.range_max;
  }

  void count_returns(std::size_t scan) {
    const Pose& pose = scans_[scan].T_world_sensor;
    ScanRequest request;
    request.index = scan;
    request.start = SimTime(kApart * scan);
    const std::vector<Beam> beams = modelled_.beams(modelled_.pattern_scan(scan, 0), executor_);
    const auto far = static_cast<float>(SensorComparison::kRanges.back());
    const std::vector<Hit> fired = render_lines(pose, beams, far, renderer_, executor_);
    std::vector<ReturnShare*> of_beam(beams.size());
    for (std::size_t i = 0; i < beams.size(); ++i) {
      if (fired[i].is_return() && is_seen(fired[i])) made_.back.plain += 1.0;
      if (blocked_[DirectionCells::of(beams[i].direction_sensor)]) continue;
      of_beam[i] = share_of(made_, fired[i]);
      if (of_beam[i] == nullptr) continue;
      of_beam[i]->beams += 1.0;
      if (is_seen(fired[i])) of_beam[i]->returns.plain += 1.0;
    }
    const Scan modelled = modelled_.take(request, PoseTrack(pose), renderer_, executor_);
    for (const ScanPoint& point : modelled.points) {
      if (point.echo != 0) continue;
      if (static_cast<double>(point.range) >= made_.least_range) made_.back.modelled += 1.0;
      if (ReturnShare* share = of_beam[point.beam]) share->returns.modelled += 1.0;
    }
    const RealBeams real = origins_.of(scans_[scan]);
    made_.back.real += static_cast<double>(real.ranges.size());
    const std::vector<Hit> met = lines(pose, real.origins_sensor, real.directions_sensor);
    for (std::size_t i = 0; i < met.size(); ++i) {
      const bool blocked = blocked_[DirectionCells::of(real.directions_sensor[i])];
      ReturnShare* share = blocked ? nullptr : share_of(made_, met[i]);
      if (share != nullptr) share->returns.real += 1.0;
    }
  }

  /// Whether lines around each direction hit something off the plane that others hit.
  [[nodiscard]] std::vector<bool> at_edges(const Pose& pose,
                                           const RealBeams& real,
                                           std::span<const Hit> middles) const {
    std::vector<Vector3f> origins;
    std::vector<Vector3f> around;
    around.reserve(kRim * middles.size());
    origins.reserve(kRim * middles.size());
    for (std::size_t i = 0; i < middles.size(); ++i) {
      const Vector3f& d = real.directions_sensor[i];
      origins.insert(origins.end(), kRim, real.origins_sensor[i]);
      const Vector3f across =
          (std::abs(d.z()) < 0.9f ? d.cross(Vector3f::UnitZ()) : d.cross(Vector3f::UnitX()))
              .normalized();
      const Vector3f up = d.cross(across);
      for (std::size_t k = 0; k < kRim; ++k) {
        const double angle = 2.0 * kPi * static_cast<double>(k) / static_cast<double>(kRim);
        const auto x = radius_ * static_cast<float>(math::cos(angle));
        const auto y = radius_ * static_cast<float>(math::sin(angle));
        around.push_back((d + x * across + y * up).normalized());
      }
    }
    const std::vector<Hit> hits = lines(pose, origins, around);
    std::vector<bool> edges(middles.size());
    for (std::size_t i = 0; i < middles.size(); ++i) {
      if (!middles[i].is_return()) continue;
      const auto r = static_cast<double>(middles[i].range);
      for (std::size_t k = 0; k < kRim / 2 && !edges[i]; ++k) {
        const Hit& one = hits[kRim * i + k];
        const Hit& other = hits[kRim * i + k + kRim / 2];
        if (!one.is_return() || !other.is_return()) {
          edges[i] = true;
          break;
        }
        // on a plane the inverse of the range is linear across the beam
        const double mean =
            0.5 * (1.0 / static_cast<double>(one.range) + 1.0 / static_cast<double>(other.range));
        edges[i] = std::abs(1.0 / mean - r) > kOffPlane;
      }
    }
    return edges;
  }

  void count_edges(std::size_t scan) {
    const RealScan& real = scans_[scan];
    const RealBeams all = origins_.of(real);
    const std::vector<Hit> middles =
        lines(real.T_world_sensor, all.origins_sensor, all.directions_sensor);
    const std::vector<bool> edges = at_edges(real.T_world_sensor, all, middles);
    const EvenErrors even(all, middles, edges);
    std::vector<Beam> chosen;
    std::vector<double> beside;
    std::vector<double> rendered;
    for (std::size_t i = 0; i < middles.size(); ++i) {
      if (!edges[i]) continue;
      chosen.emplace_back();
      chosen.back().origin_sensor = all.origins_sensor[i];
      chosen.back().direction_sensor = all.directions_sensor[i];
      rendered.push_back(static_cast<double>(middles[i].range));
      beside.push_back(even.beside(all.directions_sensor[i]));
      count_error(&Sides::real, static_cast<double>(all.ranges[i]) - rendered.back());
    }
    const auto beams = std::make_shared<const ScanBeams>(
        settings_, std::make_unique<GivenBeams>(std::move(chosen)));
    const auto count = [&](double Sides::*side, const std::optional<Surroundings>& surroundings) {
      LidarSettings settings = settings_;
      settings.noise = {};  // it is in what is added
      settings.blocked.clear();
      const Lidar lidar(settings, 0, beams, surroundings);
      ScanRequest request;
      request.index = scan;
      const Scan made = lidar.take(request, PoseTrack(real.T_world_sensor), renderer_, executor_);
      for (const ScanPoint& point : made.points) {
        const double error = static_cast<double>(point.range) - rendered[point.beam];
        count_error(side, error + beside[point.beam]);
      }
    };
    count(&Sides::modelled, surroundings_);
    count(&Sides::plain, std::nullopt);
  }

  void count_error(double Sides::*side, double error) {
    made_.edges[bin_of(SensorComparison::kErrors, error)].*side += 1.0;
  }

  const std::vector<RealScan>& scans_;
  LidarSettings settings_;
  Surroundings surroundings_;
  const Renderer& renderer_;
  const Executor& executor_;
  Lidar modelled_;
  float radius_ = 0.0f;  // tangent of what a beam's edge is off its middle
  BeamOrigins origins_;
  std::vector<bool> blocked_;  // by cell of directions
  SensorComparison made_;
};

}  // namespace

Sides SensorComparison::share_distance() const {
  Sides distance;
  double beams = 0.0;
  for (const OfIncidences& row : shares) {
    for (const ReturnShare& share : row) {
      if (!counts(share)) continue;
      beams += share.beams;
      distance.modelled += std::abs(share.returns.modelled - share.returns.real);
      distance.plain += std::abs(share.returns.plain - share.returns.real);
    }
  }
  if (beams > 0.0) {
    distance.modelled /= beams;
    distance.plain /= beams;
  }
  return distance;
}

Sides SensorComparison::edge_distance() const {
  Sides all;
  for (const Sides& bin : edges) {
    all.real += bin.real;
    all.modelled += bin.modelled;
    all.plain += bin.plain;
  }
  Sides distance;
  if (all.real <= 0.0 || all.modelled <= 0.0 || all.plain <= 0.0) return distance;
  for (const Sides& bin : edges) {
    distance.modelled += 0.5 * std::abs(bin.modelled / all.modelled - bin.real / all.real);
    distance.plain += 0.5 * std::abs(bin.plain / all.plain - bin.real / all.real);
  }
  return distance;
}

SensorComparison compare_sensor(const std::vector<RealScan>& scans,
                                const LidarSettings& lidar,
                                const Surroundings& surroundings,
                                const Renderer& renderer,
                                const Executor& executor,
                                const Progress& progress) {
  Counter counter(scans, lidar, surroundings, renderer, executor);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    report(
        progress, "comparing returns", static_cast<double>(i) / static_cast<double>(scans.size()));
    counter.add(i);
  }
  return counter.made();
}

}  // namespace pointflight
