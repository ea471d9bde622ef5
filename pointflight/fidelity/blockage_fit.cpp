#include "pointflight/fidelity/blockage_fit.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/floor.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/fidelity/real_beams.hpp"
#include "pointflight/fidelity/sensor_lines.hpp"

namespace pointflight {
namespace {

constexpr double kFarthest = 12.0;        // m: of what should surely come back
constexpr double kSureShare = 1.0 / 3.0;  // of the farthest rated range: the same
constexpr double kSureCosine = 0.34;      // of its incidence
constexpr double kTooNear = 0.25;         // m beyond the nearest returns
constexpr double kTellingBeams = 100.0;   // of a cell, to say something of it
constexpr double kLeastMost = 0.5;        // share of the most blocked of cells that hang together
constexpr double kLeastShare = 0.1;       // less is chance
constexpr double kLeastUsual = 0.5;       // share that comes back where nothing is in the way
constexpr double kUsualQuantile = 0.75;   // of the cells of one elevation
constexpr double kStep = 0.05;            // of shares

/// What is counted of each cell of directions, over all scans.
struct Counts {
  /// Beams that come back by the model.
  std::vector<double> modelled = std::vector<double>(DirectionCells::kCount);
  std::vector<double> sure = modelled;  ///< Of these: those that surely should.
  std::vector<double> real = modelled;  ///< Real returns from where these hit.
  double returns = 0.0;                 ///< All real ones.
};

double farthest_of(const LidarSettings& lidar) {
  double rated = lidar.range_max;
  for (const RatedRange& r : lidar.detection.rated) rated = std::max(rated, r.range);
  return std::min(kFarthest, kSureShare * rated);
}

/// Counts scans of one sensor.
class ScanCounter {
 public:
  ScanCounter(const std::vector<RealScan>& scans,
              const LidarSettings& settings,
              const Surroundings& surroundings,
              const Renderer& renderer,
              const Executor& executor)
      : lidar_(settings, 0, nullptr, surroundings),
        origins_(lidar_, scans.size(), executor),
        renderer_(renderer),
        executor_(executor),
        nearest_(least_range_of(scans)),
        farthest_(farthest_of(settings)) {}

  void add(const RealScan& scan, std::size_t index) {
    ScanRequest request;
    request.index = index;
    const Pose& pose = scan.T_world_sensor;
    const std::vector<Beam> beams = lidar_.beams(lidar_.pattern_scan(index, 0), executor_);
    const auto far = static_cast<float>(farthest_);
    const std::vector<Hit> fired = render_lines(pose, beams, far, renderer_, executor_);
    for (const ScanPoint& point :
         lidar_.take(request, PoseTrack(pose), renderer_, executor_).points) {
      if (point.echo != 0 || static_cast<double>(point.range) < nearest_) continue;
      const std::size_t cell = DirectionCells::of(beams[point.beam].direction_sensor);
      counts_.modelled[cell] += 1.0;
      if (is_sure(fired[point.beam])) counts_.sure[cell] += 1.0;
    }
    const RealBeams real = origins_.of(scan);
    counts_.returns += static_cast<double>(real.ranges.size());
    const std::vector<Hit> seen =
        render_lines(pose, real.origins_sensor, real.directions_sensor, far, renderer_, executor_);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (is_sure(seen[i])) counts_.real[DirectionCells::of(real.directions_sensor[i])] += 1.0;
    }
  }

  [[nodiscard]] const Counts& counts() const { return counts_; }
  /// What the sensor fires.
  [[nodiscard]] const BeamOrigins& beams() const { return origins_; }

 private:
  [[nodiscard]] bool is_sure(const Hit& hit) const {
    return hit.is_return() && static_cast<double>(hit.range) > nearest_ + kTooNear &&
           static_cast<double>(hit.cos_incidence) > kSureCosine;
  }

  Lidar lidar_;
  BeamOrigins origins_;
  const Renderer& renderer_;
  const Executor& executor_;
  double nearest_;
  double farthest_;
  Counts counts_;
};

/// What comes back of the sure beams of an elevation where nothing is in the way; 0: it does not
/// show.
double usual_of_row(const Counts& counts, std::size_t row) {
  std::vector<double> shares;
  for (std::size_t k = 0; k < DirectionCells::kColumns; ++k) {
    const std::size_t cell = row * DirectionCells::kColumns + k;
    if (counts.sure[cell] >= kTellingBeams) shares.push_back(counts.real[cell] / counts.sure[cell]);
  }
  if (shares.empty()) return 0.0;
  const auto at = shares.begin() + static_cast<std::ptrdiff_t>(
                                       kUsualQuantile * static_cast<double>(shares.size() - 1));
  std::nth_element(shares.begin(), at, shares.end());
  return *at < kLeastUsual ? 1.0 : *at;  // all of a row may be blocked
}

/// Blocked share of each cell of a row.
void find_blocked_in_row(const Counts& counts, std::size_t row, std::span<double> blocked) {
  const double usual = usual_of_row(counts, row);
  for (std::size_t k = 0; k < DirectionCells::kColumns; ++k) {
    const std::size_t cell = row * DirectionCells::kColumns + k;
    if (counts.sure[cell] < kTellingBeams) continue;
    const double share =
        std::clamp(1.0 - counts.real[cell] / (usual * counts.sure[cell]), 0.0, 1.0);
    if (share < kLeastShare) continue;
    blocked[k] = kStep * static_cast<double>(floor_to_integer(share / kStep + 0.5));
  }
}

using Shares = std::vector<double>;  ///< Of each cell of directions.

/// Cells that touch one, across the back as well.
std::vector<std::size_t> beside(std::size_t cell) {
  constexpr std::size_t kColumns = DirectionCells::kColumns;
  const std::size_t row = cell / kColumns;
  const std::size_t column = cell % kColumns;
  std::vector<std::size_t> cells = {row * kColumns + (column + 1) % kColumns,
                                    row * kColumns + (column + kColumns - 1) % kColumns};
  if (row > 0) cells.push_back(cell - kColumns);
  if (row + 1 < DirectionCells::kRows) cells.push_back(cell + kColumns);
  return cells;
}

/// Takes out what hangs together and is nowhere blocked most of the time: surfaces that are darker
/// than the model takes them to be look so, what carries a sensor does not.
void take_out_faint(Shares& blocked) {
  std::vector<bool> is_seen(blocked.size());
  for (std::size_t first = 0; first < blocked.size(); ++first) {
    if (is_seen[first] || blocked[first] <= 0.0) continue;
    std::vector<std::size_t> together = {first};
    is_seen[first] = true;
    double most = 0.0;
    for (std::size_t i = 0; i < together.size(); ++i) {
      most = std::max(most, blocked[together[i]]);
      for (const std::size_t next : beside(together[i])) {
        if (is_seen[next] || blocked[next] <= 0.0) continue;
        is_seen[next] = true;
        together.push_back(next);
      }
    }
    if (most >= kLeastMost) continue;
    for (const std::size_t cell : together) blocked[cell] = 0.0;
  }
}

/// Neighbours that are blocked alike are one sector.
void add_sectors(std::span<const double> blocked,
                 std::size_t row,
                 std::vector<BlockedSector>& sectors) {
  const double low = DirectionCells::kSize * static_cast<double>(row) - 90.0;
  for (std::size_t k = 0; k < blocked.size();) {
    std::size_t end = k + 1;
    while (end < blocked.size() && blocked[end] == blocked[k]) ++end;
    if (blocked[k] > 0.0) {
      sectors.push_back({DirectionCells::kSize * static_cast<double>(k) - 180.0,
                         DirectionCells::kSize * static_cast<double>(end) - 180.0,
                         low,
                         low + DirectionCells::kSize,
                         blocked[k]});
    }
    k = end;
  }
}

}  // namespace

BlockageFit fit_blockage(const std::vector<RealScan>& scans,
                         const LidarSettings& lidar,
                         const Surroundings& surroundings,
                         const Renderer& renderer,
                         const Executor& executor,
                         const Progress& progress) {
  LidarSettings settings = lidar;
  settings.blocked.clear();
  ScanCounter counter(scans, settings, surroundings, renderer, executor);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    report(progress,
           "looking for what is in the way",
           static_cast<double>(i) / static_cast<double>(scans.size()));
    counter.add(scans[i], i);
  }
  const Counts& counts = counter.counts();
  BlockageFit fit;
  fit.scans = scans.size();
  const double all = counter.beams().beams();
  Shares blocked(DirectionCells::kCount);
  const auto of_row = [&](std::size_t row) {
    return std::span(blocked).subspan(row * DirectionCells::kColumns, DirectionCells::kColumns);
  };
  for (std::size_t row = 0; row < DirectionCells::kRows; ++row) {
    find_blocked_in_row(counts, row, of_row(row));
  }
  take_out_faint(blocked);
  for (std::size_t row = 0; row < DirectionCells::kRows; ++row) {
    add_sectors(of_row(row), row, fit.sectors);
  }
  for (std::size_t cell = 0; cell < blocked.size(); ++cell) {
    const double fired = counter.beams().fired(cell);
    if (counts.sure[cell] >= kTellingBeams) fit.told += fired;
    fit.blocked += blocked[cell] * fired;
    fit.modelled += counts.modelled[cell];
    fit.explained += (1.0 - blocked[cell]) * counts.modelled[cell];
  }
  fit.returns = counts.returns / all;
  for (double* sum : {&fit.told, &fit.blocked, &fit.modelled, &fit.explained}) *sum /= all;
  if (fit.told <= 0.0) {
    throw InputError(
        "no direction of the sensor hits the map often enough near it to tell what is in the way: "
        "are poses and map of these scans?");
  }
  return fit;
}

}  // namespace pointflight
