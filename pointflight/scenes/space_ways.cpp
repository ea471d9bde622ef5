#include "pointflight/scenes/space_ways.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "pointflight/geometry/polyline.hpp"

namespace pointflight {
namespace {

/// A step to one of the 26 cells around.
struct Step {
  SceneSpace::Index3 by;
  std::uint32_t cost;
};

std::vector<Step> make_steps() {
  constexpr std::array<std::uint32_t, 4> kCosts = {0, SpaceWays::kStep, 28, 35};
  std::vector<Step> steps;
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        const int axes = std::abs(x) + std::abs(y) + std::abs(z);
        if (axes > 0) steps.push_back({{x, y, z}, kCosts[static_cast<std::size_t>(axes)]});
      }
    }
  }
  return steps;
}

const std::vector<Step>& steps_around() {
  static const std::vector<Step> steps = make_steps();
  return steps;
}

}  // namespace

SpaceWays::SpaceWays(const SceneSpace& space) : space_(space) {
  number_.assign(space.count(), kUnreached);
  for (std::size_t at = 0; at < space.count(); ++at) {
    if (!space.is_flyable(at)) continue;
    number_[at] = static_cast<std::uint32_t>(cells_.size());
    cells_.push_back(static_cast<std::uint32_t>(at));
  }
}

std::uint32_t SpaceWays::number_at(const Vector3d& p_world) const {
  return number_[space_.cell_of(p_world)];
}

template <class Visit>
void SpaceWays::for_neighbours(std::uint32_t at, const Visit& visit) const {
  const SceneSpace::Index3 cell = space_.index3(cells_[at]);
  for (const Step& step : steps_around()) {
    SceneSpace::Index3 next{};
    bool is_inside = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      next[axis] = cell[axis] + step.by[axis];
      is_inside = is_inside && next[axis] >= 0 && next[axis] < space_.size()[axis];
    }
    if (!is_inside) continue;
    const std::uint32_t number = number_[space_.flat(next)];
    if (number != kUnreached) visit(number, step.cost);
  }
}

/// Buckets of equal cost (Dial, "Algorithm 360: shortest-path forest with topological ordering",
/// 1969).
std::vector<std::uint32_t> SpaceWays::shortest_from(std::uint32_t from, std::uint32_t limit) const {
  constexpr std::uint32_t kBuckets = 36;  // more than the greatest cost of a step
  std::vector<std::uint32_t> cost(cells_.size(), kUnreached);
  std::vector<std::vector<std::uint32_t>> buckets(kBuckets);
  cost[from] = 0;
  buckets[0].push_back(from);
  std::size_t open = 1;
  for (std::uint32_t now = 0; open > 0 && now <= limit; ++now) {
    std::vector<std::uint32_t> due;
    std::swap(due, buckets[now % kBuckets]);
    open -= due.size();
    for (const std::uint32_t at : due) {
      if (cost[at] != now) continue;  // was found again at less
      for_neighbours(at, [&](std::uint32_t next, std::uint32_t step) {
        if (now + step >= cost[next]) return;
        cost[next] = now + step;
        buckets[(now + step) % kBuckets].push_back(next);
        ++open;
      });
    }
  }
  return cost;
}

/// From the widest level of room down, each with what can be reached at it.
std::vector<float> SpaceWays::widest_from(std::uint32_t from) const {
  constexpr int kLevels = 4 * SceneSpace::kReach;
  const double most = SceneSpace::kReach * space_.cell();
  const auto level_of = [&](std::uint32_t at) {
    const double share = std::clamp(space_.clearance(cells_[at]) / most, 0.0, 1.0);
    return static_cast<std::size_t>(share * (kLevels - 1));
  };
  std::vector<float> room(cells_.size(), -1.0f);
  std::vector<bool> is_queued(cells_.size(), false);
  std::array<std::vector<std::uint32_t>, kLevels> levels;
  levels[level_of(from)].push_back(from);
  is_queued[from] = true;
  for (std::size_t level = kLevels; level-- > 0;) {
    const double here = most * static_cast<double>(level) / (kLevels - 1);
    for (std::size_t i = 0; i < levels[level].size(); ++i) {
      const std::uint32_t at = levels[level][i];
      room[at] = static_cast<float>(here);
      for_neighbours(at, [&](std::uint32_t next, std::uint32_t /*step*/) {
        if (is_queued[next]) return;
        is_queued[next] = true;
        levels[std::min(level, level_of(next))].push_back(next);
      });
    }
  }
  return room;
}

std::vector<Vector3d> SpaceWays::way_back(const std::vector<std::uint32_t>& cost,
                                          std::uint32_t to) const {
  std::vector<Vector3d> way = {space_.center(cells_[to])};
  for (std::uint32_t at = to; cost[at] > 0;) {
    std::uint32_t before = at;
    for_neighbours(at, [&](std::uint32_t next, std::uint32_t step) {
      if (cost[next] != kUnreached && cost[next] + step == cost[at]) before = next;
    });
    at = before;
    way.push_back(space_.center(cells_[at]));
  }
  std::reverse(way.begin(), way.end());
  return way;
}

std::vector<Vector3d> straightened(const SceneSpace& space, const std::vector<Vector3d>& way) {
  const double radius = space.options().radius;
  return with_fewer_corners(way, [&](std::size_t from, std::size_t to) {
    return space.clearance(way[from], way[to]) >= radius;
  });
}

std::vector<Vector3d> with_room(const SceneSpace& space, std::vector<Vector3d> way, double room) {
  constexpr int kMoves = 12;  // of a cell each
  for (int move = 0; move < kMoves; ++move) {
    for (std::size_t i = 1; i + 1 < way.size(); ++i) {
      const auto room_with = [&](const Vector3d& corner) {
        return std::min(
            {space.clearance(way[i - 1], corner), space.clearance(corner, way[i + 1]), room});
      };
      Vector3d best = way[i];
      double most = room_with(best);
      for (const Step& step : steps_around()) {
        const Vector3d to = way[i] + space.cell() * Vector3d(step.by[0], step.by[1], step.by[2]);
        if (!space.is_flyable(space.cell_of(to))) continue;
        const double there = room_with(to);
        if (there <= most) continue;
        most = there;
        best = to;
      }
      way[i] = best;
    }
  }
  return way;
}

}  // namespace pointflight
