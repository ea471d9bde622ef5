#include "pointflight/scenes/scene_space.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/floor.hpp"
#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

constexpr std::uint16_t kFar = SceneSpace::kReach * SceneSpace::kReach;
constexpr double kBelow = 3.0;   // m under where sensors may stand: the floor
constexpr double kBeside = 1.0;  // m beside it and above: walls

bool contains(const Aabb& box, const Vector3d& p) {
  return (p - box.min).minCoeff() >= 0.0 && (box.max - p).minCoeff() >= 0.0;
}

/// Points spread evenly over a shape, about `spacing` apart (additive recurrence with the plastic
/// number: M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018).
template <class Visit>
void visit_points_on(const Shape& shape, double spacing, const Visit& visit) {
  constexpr double kU = 0.7548776662466927;
  constexpr double kV = 0.5698402909980532;
  const auto count = static_cast<std::uint64_t>(area(shape) / (spacing * spacing)) + 1;
  double u = 0.5;
  double v = 0.5;
  for (std::uint64_t i = 0; i < count; ++i) {
    visit(point_on(shape, u, v));
    u += kU;
    v += kV;
    if (u >= 1.0) u -= 1.0;
    if (v >= 1.0) v -= 1.0;
  }
}

}  // namespace

SceneSpace::SceneSpace(const ExactScene& scene,
                       const SpaceOptions& options,
                       const Executor& executor)
    : options_(options), free_(scene.free) {
  Aabb box = scene.free;
  box.min -= Vector3d(kBeside, kBeside, kBelow);
  box.max += Vector3d(kBeside, kBeside, kBeside);
  const Vector3d extent = box.size();
  options_.cell = std::max(options.cell, std::cbrt(extent.prod() / options.cells_max));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double cells = extent[static_cast<int>(axis)] / options_.cell;
    size_[axis] = std::max(1, static_cast<int>(std::ceil(cells)));
  }
  low_ = box.min;
  mark_surfaces(scene);
  measure(executor);
  measure_heights();
  choose_part(scene.name);
}

std::size_t SceneSpace::flat(const Index3& cell) const {
  const auto x = static_cast<std::size_t>(cell[0]);
  const auto y = static_cast<std::size_t>(cell[1]);
  const auto z = static_cast<std::size_t>(cell[2]);
  return (z * static_cast<std::size_t>(size_[1]) + y) * static_cast<std::size_t>(size_[0]) + x;
}

SceneSpace::Index3 SceneSpace::index3(std::size_t at) const {
  const auto nx = static_cast<std::size_t>(size_[0]);
  const auto ny = static_cast<std::size_t>(size_[1]);
  return {
      static_cast<int>(at % nx), static_cast<int>(at / nx % ny), static_cast<int>(at / (nx * ny))};
}

Vector3d SceneSpace::center(std::size_t at) const {
  const Index3 i = index3(at);
  return low_ + options_.cell * Vector3d(i[0] + 0.5, i[1] + 0.5, i[2] + 0.5);
}

std::size_t SceneSpace::cell_of(const Vector3d& p_world) const {
  Index3 cell{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<int>(axis);
    const double at = std::clamp((p_world[k] - low_[k]) / options_.cell, 0.0, 1e6);
    cell[axis] = std::min(static_cast<int>(at), size_[axis] - 1);
  }
  return flat(cell);
}

double SceneSpace::clearance(std::size_t at) const {
  // a surface lies anywhere in its cell
  return options_.cell * (std::sqrt(static_cast<double>(squared_[at])) - 0.5);
}

double SceneSpace::clearance(const Vector3d& from, const Vector3d& to) const {
  const int steps = static_cast<int>((to - from).norm() / (0.5 * options_.cell)) + 1;
  double least = kReach * options_.cell;
  for (int i = 0; i <= steps; ++i) {
    least = std::min(least, clearance(cell_of(from + (to - from) * (1.0 * i / steps))));
  }
  return least;
}

double SceneSpace::height(std::size_t at) const {
  return options_.cell * height_[at];
}

bool SceneSpace::is_flyable(std::size_t at) const {
  return reachable_[at] && height(at) >= options_.low && height(at) <= options_.high;
}

double SceneSpace::reachable_volume() const {
  const auto cells = std::count(reachable_.begin(), reachable_.end(), true);
  return static_cast<double>(cells) * options_.cell * options_.cell * options_.cell;
}

double SceneSpace::flyable_share() const {
  const std::size_t columns =
      static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]);
  std::size_t floors = 0;
  std::size_t flown = 0;
  for (std::size_t column = 0; column < columns; ++column) {
    bool has_room = false;  // over the surface that was last below
    bool is_flown = false;
    const auto end_floor = [&] {
      floors += has_room ? 1 : 0;
      flown += is_flown ? 1 : 0;
      has_room = is_flown = false;
    };
    for (std::size_t at = column; at < count(); at += columns) {
      if (is_surface(at)) end_floor();
      has_room = has_room || (height(at) >= options_.low && height(at) <= options_.high &&
                              contains(free_, center(at)));
      is_flown = is_flown || is_flyable(at);
    }
    end_floor();
  }
  return floors == 0 ? 0.0 : static_cast<double>(flown) / static_cast<double>(floors);
}

void SceneSpace::mark_surfaces(const ExactScene& scene) {
  const std::size_t cells = static_cast<std::size_t>(size_[0]) *
                            static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(size_[2]);
  squared_.assign(cells, kFar);
  const Vector3d limit = options_.cell * Vector3d(size_[0], size_[1], size_[2]);
  for (const Shape& shape : scene.geometry.shapes) {
    const Aabb box = bounds(shape);
    if (((box.max - low_).array() < 0.0).any() ||
        ((box.min - low_).array() > limit.array()).any()) {
      continue;
    }
    visit_points_on(shape, 0.4 * options_.cell, [&](const Vector3d& p) {
      Index3 cell{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<int>(axis);
        cell[axis] = static_cast<int>(floor_to_integer((p[k] - low_[k]) / options_.cell));
        if (cell[axis] < 0 || cell[axis] >= size_[axis]) return;
      }
      squared_[flat(cell)] = 0;
    });
  }
}

/// Distances along x, then along y and z with those before (Saito and Toriwaki, "New algorithms for
/// Euclidean distance transformation", 1994), up to `kReach`.
void SceneSpace::measure(const Executor& executor) {
  const auto nx = static_cast<std::size_t>(size_[0]);
  const auto ny = static_cast<std::size_t>(size_[1]);
  const auto nz = static_cast<std::size_t>(size_[2]);
  executor.parallel_for(ny * nz, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      std::uint16_t* cells = squared_.data() + row * nx;
      int away = kReach;
      const auto step = [&](std::size_t x) {
        away = cells[x] == 0 ? 0 : std::min(away + 1, kReach);
        cells[x] = std::min(cells[x], static_cast<std::uint16_t>(away * away));
      };
      for (std::size_t x = 0; x < nx; ++x) step(x);
      away = kReach;
      for (std::size_t x = nx; x-- > 0;) step(x);
    }
  });
  std::vector<std::uint16_t> before;
  const auto pass = [&](std::size_t length, std::size_t stride, const auto& first_of) {
    before = squared_;
    const std::size_t rows = count() / (nx * length);
    executor.parallel_for(rows, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) {
        const std::size_t first = first_of(row);
        for (std::size_t at = 0; at < length; ++at) {
          std::uint16_t* to = squared_.data() + first + at * stride;
          for (int d = -kReach + 1; d < kReach; ++d) {
            const std::int64_t other = static_cast<std::int64_t>(at) + d;
            if (other < 0 || other >= static_cast<std::int64_t>(length)) continue;
            const std::uint16_t* from =
                before.data() + first + static_cast<std::size_t>(other) * stride;
            const auto more = static_cast<std::uint16_t>(d * d);
            for (std::size_t x = 0; x < nx; ++x) {
              to[x] = std::min(to[x], static_cast<std::uint16_t>(from[x] + more));
            }
          }
        }
      }
    });
  };
  pass(ny, nx, [&](std::size_t row) { return row * nx * ny; });
  pass(nz, nx * ny, [&](std::size_t row) { return row * nx; });
}

void SceneSpace::measure_heights() {
  const std::size_t columns =
      static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]);
  height_.assign(count(), -1);
  for (std::size_t column = 0; column < columns; ++column) {
    std::int16_t height = -1;
    for (std::size_t at = column; at < count(); at += columns) {
      if (is_surface(at)) {
        height = 0;
      } else if (height >= 0) {
        ++height;
      }
      height_[at] = height;
    }
  }
}

bool SceneSpace::fits(std::size_t at) const {
  return clearance(at) >= options_.radius && contains(free_, center(at));
}

std::vector<std::uint32_t> SceneSpace::part_of(std::size_t start, std::vector<bool>& seen) const {
  std::vector<std::uint32_t> part = {static_cast<std::uint32_t>(start)};
  seen[start] = true;
  for (std::size_t next = 0; next < part.size(); ++next) {
    const Index3 cell = index3(part[next]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        Index3 beside = cell;
        beside[axis] += step;
        if (beside[axis] < 0 || beside[axis] >= size_[axis]) continue;
        const std::size_t at = flat(beside);
        if (seen[at] || !fits(at)) continue;
        seen[at] = true;
        part.push_back(static_cast<std::uint32_t>(at));
      }
    }
  }
  return part;
}

/// The one with most cells at flight height: neither the inside of rock, which has no floor, nor
/// that of a lorry.
void SceneSpace::choose_part(const std::string& scene) {
  std::vector<bool> seen(count(), false);
  std::vector<std::uint32_t> best;
  std::ptrdiff_t most = 0;
  const auto is_at_height = [&](std::size_t at) {
    return height(at) >= options_.low && height(at) <= options_.high;
  };
  for (std::size_t at = 0; at < count(); ++at) {
    if (seen[at] || !is_at_height(at) || !fits(at)) continue;
    std::vector<std::uint32_t> part = part_of(at, seen);
    const auto cells = std::count_if(part.begin(), part.end(), is_at_height);
    if (cells <= most) continue;
    most = cells;
    best = std::move(part);
  }
  if (best.empty()) {
    throw InputError(fmt::format(
        "scene '{}': nothing of radius {} m fits anywhere {} to {} m above what is below",
        scene,
        options_.radius,
        options_.low,
        options_.high));
  }
  reachable_.assign(count(), false);
  for (const std::uint32_t at : best) reachable_[at] = true;
}

}  // namespace pointflight
