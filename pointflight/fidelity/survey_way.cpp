#include "pointflight/fidelity/survey_way.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "pointflight/geometry/polyline.hpp"
#include "pointflight/scenes/space_ways.hpp"

namespace pointflight {
namespace {

constexpr double kNearest = 2.0;  // m: nobody has to come nearer to everything
constexpr double kFarthest = 15.0;

/// What has been seen from nearby so far.
class Coverage {
 public:
  Coverage(const SceneSpace& space, const SpaceWays& ways, double reach)
      : space_(space), ways_(ways), reach_(reach), is_seen_(ways.cells().size(), false) {}

  /// All that is within reach of a cell (by number), along ways: not behind walls.
  void look_from(std::uint32_t at) {
    const double steps = reach_ / space_.cell();
    const auto cost = ways_.shortest_from(at, static_cast<std::uint32_t>(steps * SpaceWays::kStep));
    for (std::size_t i = 0; i < cost.size(); ++i) {
      if (cost[i] != SpaceWays::kUnreached) is_seen_[i] = true;
    }
  }

  /// The nearest cell that has not been seen, by costs from where one is.
  [[nodiscard]] std::optional<std::uint32_t> next(const std::vector<std::uint32_t>& cost) const {
    std::optional<std::uint32_t> best;
    for (std::size_t i = 0; i < cost.size(); ++i) {
      if (is_seen_[i] || cost[i] == SpaceWays::kUnreached) continue;
      if (!best || cost[i] < cost[*best]) best = static_cast<std::uint32_t>(i);
    }
    return best;
  }

 private:
  const SceneSpace& space_;
  const SpaceWays& ways_;
  double reach_;  ///< m
  std::vector<bool> is_seen_;
};

/// Appends a way, its first point left out.
void append(std::vector<Vector3d>& way, const std::vector<Vector3d>& leg) {
  way.insert(way.end(), leg.begin() + 1, leg.end());
}

/// The first cell of the largest part that is connected at this height.
std::uint32_t start_in(const SpaceWays& ways) {
  std::vector<bool> is_known(ways.cells().size(), false);
  std::uint32_t best = 0;
  std::ptrdiff_t most = 0;
  for (std::uint32_t at = 0; at < is_known.size(); ++at) {
    if (is_known[at]) continue;
    const auto cost = ways.shortest_from(at);
    std::ptrdiff_t cells = 0;
    for (std::size_t i = 0; i < cost.size(); ++i) {
      if (cost[i] == SpaceWays::kUnreached) continue;
      is_known[i] = true;
      ++cells;
    }
    if (cells > most) best = at;
    most = std::max(most, cells);
  }
  return best;
}

/// Corners; ends where it began.
std::vector<Vector3d> way_with(const SceneSpace& space,
                               const SpaceWays& ways,
                               std::uint32_t start,
                               double reach) {
  Coverage coverage(space, ways, reach);
  std::uint32_t at = start;
  std::vector<Vector3d> way = {space.center(ways.cells()[at])};
  coverage.look_from(at);
  for (;;) {
    const auto cost = ways.shortest_from(at);
    const auto to = coverage.next(cost);
    if (!to) break;
    const std::vector<Vector3d> cells = ways.way_back(cost, *to);
    const auto step = static_cast<std::size_t>(std::max(1.0, 0.5 * reach / space.cell()));
    for (std::size_t i = step; i < cells.size(); i += step) {
      coverage.look_from(ways.number_at(cells[i]));
    }
    coverage.look_from(*to);
    append(way, straightened(space, cells));
    at = *to;
  }
  if (at != start) {
    append(way, straightened(space, ways.way_back(ways.shortest_from(at), start)));
  }
  return way;
}

/// Of the floor that can be walked on, m^2.
double area_of(const SceneSpace& space, const SpaceWays& ways) {
  std::vector<std::size_t> columns;
  const auto plane =
      static_cast<std::size_t>(space.size()[0]) * static_cast<std::size_t>(space.size()[1]);
  for (const std::uint32_t cell : ways.cells()) columns.push_back(cell % plane);
  std::sort(columns.begin(), columns.end());
  const auto end = std::unique(columns.begin(), columns.end());
  return static_cast<double>(end - columns.begin()) * space.cell() * space.cell();
}

}  // namespace

std::vector<Vector3d> plan_survey_way(const ExactScene& scene,
                                      double length,
                                      const Executor& executor) {
  SpaceOptions options;
  options.radius = 0.25;
  options.low = 1.2;
  options.high = 1.8;
  options.cell = 0.2;
  const SceneSpace space(scene, options, executor);
  const SpaceWays ways(space);
  const std::uint32_t start = start_in(ways);
  double reach = std::clamp(0.7 * area_of(space, ways) / length, kNearest, kFarthest);
  for (;;) {
    std::vector<Vector3d> way = way_with(space, ways, start, reach);
    if (length_of(way) <= 1.1 * length || reach >= kFarthest) return way;
    reach *= 1.4;
  }
}

}  // namespace pointflight
