#include "pointflight/world/free_space.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <deque>

#include "pointflight/geometry/polyline.hpp"
#include "pointflight/world/clearance.hpp"

namespace pointflight {
namespace {

constexpr double kCellMin = 0.5;  // m
constexpr double kCellsMax = 400000.0;
constexpr double kGroundMin = 0.8;  // m above the ground, preferred
constexpr double kGroundMax = 3.5;

using Index3 = std::array<int, 3>;

/// At which heights a vehicle may be.
enum class Heights {
  kNearGround,   ///< Where people fly drones.
  kAboveGround,  ///< Wherever something is below.
  kAny
};

/// A coarse grid over the map that knows where a vehicle fits and what surrounds the position.
class FreeSpaceGrid {
 public:
  FreeSpaceGrid(const SurfelMap& map, const TourOptions& options, const Executor& executor)
      : map_(map), options_(options) {
    Aabb bounds = map.bounds_world();
    if (options.bounds) {
      // with the ground below it
      bounds.min =
          bounds.min.cwiseMax(options.bounds->min - (kGroundMax + 1.0) * Vector3d::UnitZ());
      bounds.max = bounds.max.cwiseMin(options.bounds->max);
    }
    const Vector3d extent = bounds.size().cwiseMax(kCellMin);
    cell_ = std::max(kCellMin, std::cbrt(extent.prod() / kCellsMax));
    // of a long and thin map whole cells are many more than its volume says
    const auto cells = [&] { return (extent / cell_).array().ceil().prod(); };
    while (cells() > 2.0 * kCellsMax) cell_ *= 1.25;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      size_[axis] =
          std::max(1, static_cast<int>(std::ceil(extent[static_cast<int>(axis)] / cell_)));
    }
    low_ = bounds.min;
    measure(executor);
    look_around();
  }

  [[nodiscard]] std::size_t count() const { return distance_.size(); }
  [[nodiscard]] double cell() const { return cell_; }

  [[nodiscard]] Vector3d center(std::size_t at) const {
    const Index3 i = index3(at);
    return low_ + cell_ * Vector3d(i[0] + 0.5, i[1] + 0.5, i[2] + 0.5);
  }

  /// Cells where a vehicle may be: free, at that height, and walls in at least `sides` of the eight
  /// horizontal directions.
  [[nodiscard]] std::vector<bool> usable(int sides, Heights heights) const {
    // neighbouring cells must be connected by a free line: half a cell of reserve
    const double needed = options_.radius + options_.margin + 0.5 * cell_;
    std::vector<bool> ok(count());
    for (std::size_t i = 0; i < ok.size(); ++i) {
      const bool height_ok = heights == Heights::kAny ||
                             (heights == Heights::kAboveGround && ground_[i] >= 0.0f) ||
                             (ground_[i] >= static_cast<float>(kGroundMin) &&
                              ground_[i] <= static_cast<float>(kGroundMax));
      ok[i] = distance_[i] > static_cast<float>(needed) && sides_[i] >= sides && height_ok &&
              is_inside(center(i)) && (heights == Heights::kAny || is_accepted(i));
    }
    return ok;
  }

  [[nodiscard]] bool is_inside(const Vector3d& p) const {
    return !options_.bounds || ((p - options_.bounds->min).minCoeff() >= 0.0 &&
                                (options_.bounds->max - p).minCoeff() >= 0.0);
  }

  /// The six neighbours inside the grid.
  template <class Visit>
  void for_neighbours(std::size_t at, const Visit& visit) const {
    const Index3 i = index3(at);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        Index3 j = i;
        j[axis] += step;
        if (j[axis] >= 0 && j[axis] < size_[axis]) visit(flat(j));
      }
    }
  }

  [[nodiscard]] std::size_t cell_of(const Vector3d& p) const {
    Index3 i{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double at = (p[static_cast<int>(axis)] - low_[static_cast<int>(axis)]) / cell_;
      i[axis] = std::clamp(static_cast<int>(std::floor(at)), 0, size_[axis] - 1);
    }
    return flat(i);
  }

 private:
  /// Asked once for each cell.
  [[nodiscard]] bool is_accepted(std::size_t at) const {
    if (!options_.accepts) return true;
    if (accepted_.empty()) accepted_.assign(count(), kUnasked);
    if (accepted_[at] == kUnasked) accepted_[at] = options_.accepts(center(at)) ? 1 : 0;
    return accepted_[at] == 1;
  }

  [[nodiscard]] std::size_t flat(const Index3& i) const {
    return (static_cast<std::size_t>(i[2]) * static_cast<std::size_t>(size_[1]) +
            static_cast<std::size_t>(i[1])) *
               static_cast<std::size_t>(size_[0]) +
           static_cast<std::size_t>(i[0]);
  }
  [[nodiscard]] Index3 index3(std::size_t at) const {
    const auto nx = static_cast<std::size_t>(size_[0]);
    const auto ny = static_cast<std::size_t>(size_[1]);
    return {static_cast<int>(at % nx),
            static_cast<int>(at / nx % ny),
            static_cast<int>(at / (nx * ny))};
  }

  void measure(const Executor& executor) {
    const double reach =
        std::max(options_.radius + options_.margin + 0.5 * cell_, 0.87 * cell_) + 0.01;
    const std::size_t cells = static_cast<std::size_t>(size_[0]) *
                              static_cast<std::size_t>(size_[1]) *
                              static_cast<std::size_t>(size_[2]);
    distance_.resize(cells);
    executor.parallel_for(cells, 1024, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const auto nearest = map_.nearest(center(i), reach);
        distance_[i] = static_cast<float>(nearest ? nearest->distance : 2.0 * reach);
      }
    });
  }

  [[nodiscard]] bool occupied(std::size_t at) const {
    return distance_[at] < static_cast<float>(0.5 * cell_);
  }

  /// For each cell: height above the first occupied cell below (negative: none), and the number of
  /// horizontal directions with something in them.
  void look_around() {
    ground_.assign(count(), -1.0f);
    sides_.assign(count(), 0);
    constexpr std::array<Index3, 8> kDirections = {Index3{1, 0, 0},
                                                   Index3{-1, 0, 0},
                                                   Index3{0, 1, 0},
                                                   Index3{0, -1, 0},
                                                   Index3{1, 1, 0},
                                                   Index3{-1, -1, 0},
                                                   Index3{1, -1, 0},
                                                   Index3{-1, 1, 0}};
    for (std::size_t at = 0; at < count(); ++at) {
      Index3 i = index3(at);
      for (int steps = 0; i[2] >= 0; --i[2], ++steps) {
        const std::size_t below = flat(i);
        if (!occupied(below)) continue;
        // the surface lies about `distance` under the lowest free cell's centre
        ground_[at] = static_cast<float>(steps * cell_);
        break;
      }
    }
    for (std::size_t at = 0; at < count(); ++at) {
      if (occupied(at)) continue;
      for (const Index3& d : kDirections) sides_[at] += blocked(at, d) ? 1 : 0;
    }
  }

  [[nodiscard]] bool blocked(std::size_t at, const Index3& direction) const {
    Index3 i = index3(at);
    for (;;) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        i[axis] += direction[axis];
        if (i[axis] < 0 || i[axis] >= size_[axis]) return false;
      }
      if (occupied(flat(i))) return true;
    }
  }

  const SurfelMap& map_;
  const TourOptions& options_;
  Vector3d low_ = Vector3d::Zero();
  double cell_ = 0.0;
  Index3 size_{};
  std::vector<float> distance_;
  std::vector<float> ground_;
  std::vector<int> sides_;
  static constexpr std::int8_t kUnasked = -1;
  mutable std::vector<std::int8_t> accepted_;
};

constexpr int kUnreached = -1;

/// Steps from a cell to each usable cell; kUnreached elsewhere.
std::vector<int> flood(const FreeSpaceGrid& grid,
                       const std::vector<bool>& usable,
                       std::size_t from) {
  std::vector<int> steps(grid.count(), kUnreached);
  std::deque<std::size_t> queue = {from};
  steps[from] = 0;
  while (!queue.empty()) {
    const std::size_t at = queue.front();
    queue.pop_front();
    grid.for_neighbours(at, [&](std::size_t next) {
      if (!usable[next] || steps[next] != kUnreached) return;
      steps[next] = steps[at] + 1;
      queue.push_back(next);
    });
  }
  return steps;
}

std::size_t farthest(const std::vector<int>& steps) {
  return static_cast<std::size_t>(std::max_element(steps.begin(), steps.end()) - steps.begin());
}

/// Cells from the flood's origin to `to`.
std::vector<std::size_t> walk_back(const FreeSpaceGrid& grid,
                                   const std::vector<int>& steps,
                                   std::size_t to) {
  std::vector<std::size_t> path = {to};
  while (steps[path.back()] > 0) {
    std::size_t best = path.back();
    grid.for_neighbours(path.back(), [&](std::size_t next) {
      if (steps[next] == steps[path.back()] - 1) best = next;
    });
    path.push_back(best);
  }
  std::reverse(path.begin(), path.end());
  return path;
}

/// A cell of the largest connected part, or nothing.
std::optional<std::size_t> in_largest_part(const FreeSpaceGrid& grid,
                                           const std::vector<bool>& usable) {
  std::vector<bool> seen(grid.count(), false);
  std::optional<std::size_t> best;
  std::size_t best_size = 0;
  for (std::size_t i = 0; i < grid.count(); ++i) {
    if (!usable[i] || seen[i]) continue;
    std::vector<std::size_t> open = {i};
    seen[i] = true;
    std::size_t size = 0;
    while (!open.empty()) {
      const std::size_t at = open.back();
      open.pop_back();
      ++size;
      grid.for_neighbours(at, [&](std::size_t next) {
        if (!usable[next] || seen[next]) return;
        seen[next] = true;
        open.push_back(next);
      });
    }
    if (size > best_size) {
      best_size = size;
      best = i;
    }
  }
  return best;
}

/// Drops points between which a straight line stays free.
std::vector<Vector3d> straightened(const SurfelMap& map,
                                   const TourOptions& options,
                                   const std::vector<Vector3d>& path) {
  return with_fewer_corners(path, [&](std::size_t from, std::size_t to) {
    return clearance_along(map, path[from], path[to], options.radius, 2.0 * options.margin) >=
           options.margin;
  });
}

/// A tour among usable cells: from one end to the other, then to what is farthest from both, ...
Tour tour_in(const SurfelMap& map,
             const TourOptions& options,
             const FreeSpaceGrid& grid,
             const std::vector<bool>& usable) {
  constexpr int kLegsMax = 12;
  Tour tour;
  std::optional<std::size_t> seed;
  if (options.start) {
    const std::size_t cell = grid.cell_of(*options.start);
    if (usable[cell]) seed = cell;
  } else {
    seed = in_largest_part(grid, usable);
  }
  if (!seed) return tour;
  std::size_t at = options.start ? *seed : farthest(flood(grid, usable, *seed));
  tour.points_world = {options.start ? *options.start : grid.center(at)};
  std::vector<int> nearest_visited(grid.count(), std::numeric_limits<int>::max());
  for (int leg = 0; leg < kLegsMax && tour.length < options.length_min; ++leg) {
    const auto steps = flood(grid, usable, at);
    std::size_t goal = at;
    int best = 0;
    for (std::size_t i = 0; i < steps.size(); ++i) {
      if (steps[i] == kUnreached) continue;
      nearest_visited[i] = std::min(nearest_visited[i], steps[i]);
      if (nearest_visited[i] > best) {
        best = nearest_visited[i];
        goal = i;
      }
    }
    if (goal == at) break;
    std::vector<Vector3d> path = {tour.points_world.back()};
    for (const std::size_t cell : walk_back(grid, steps, goal)) path.push_back(grid.center(cell));
    path = straightened(map, options, path);
    tour.points_world.insert(tour.points_world.end(), path.begin() + 1, path.end());
    tour.length = length_of(tour.points_world);
    at = goal;
  }
  return tour;
}

/// True if a vehicle could be somewhere above ground, within the bounds or elsewhere.
bool has_ground(const SurfelMap& map, const TourOptions& options, const Executor& executor) {
  TourOptions anywhere = options;
  anywhere.bounds.reset();
  const std::vector<bool> usable =
      FreeSpaceGrid(map, anywhere, executor).usable(0, Heights::kAboveGround);
  return std::find(usable.begin(), usable.end(), true) != usable.end();
}

}  // namespace

std::optional<Tour> find_tour(const SurfelMap& map,
                              const TourOptions& options,
                              const Executor& executor) {
  if (map.surfel_count() == 0) return std::nullopt;
  const FreeSpaceGrid grid(map, options, executor);
  // well enclosed positions if they make a tour long enough, else the longest of all
  Tour best;
  for (const Heights heights : {Heights::kNearGround, Heights::kAboveGround, Heights::kAny}) {
    // where a map has ground nobody wants to be without
    if (heights == Heights::kAny &&
        (best.points_world.size() >= 2 || has_ground(map, options, executor))) {
      break;
    }
    for (const int sides : {6, 4, 2, 0}) {
      Tour tour = tour_in(map, options, grid, grid.usable(sides, heights));
      tour.has_ground = heights != Heights::kAny;
      if (tour.length > best.length) best = std::move(tour);
      if (best.length >= options.length_min) return best;
    }
  }
  if (best.points_world.size() < 2) return std::nullopt;
  return best;
}

std::optional<Vector3d> nearest_free_position(const SurfelMap& map,
                                              const Vector3d& near_world,
                                              double radius,
                                              const Executor& executor) {
  if (map.surfel_count() == 0) return std::nullopt;
  for (const double margin : {0.5, 0.3, 0.15}) {
    TourOptions options;
    options.radius = radius;
    options.margin = margin;
    const FreeSpaceGrid grid(map, options, executor);
    for (const Heights heights : {Heights::kAboveGround, Heights::kAny}) {
      const std::vector<bool> usable = grid.usable(0, heights);
      std::optional<Vector3d> best;
      for (std::size_t i = 0; i < usable.size(); ++i) {
        const Vector3d at = grid.center(i);
        const bool nearer =
            !best || (at - near_world).squaredNorm() < (*best - near_world).squaredNorm();
        if (usable[i] && nearer) best = at;
      }
      if (best) return best;
    }
  }
  return std::nullopt;
}

}  // namespace pointflight
