#include "pointflight/picture/map_layers.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace pointflight::picture {
namespace {

constexpr int kLevels = 64;           // bits of a column
constexpr double kLeastGap = 0.4;     // m, between a thing and the ceiling over it
constexpr double kLeastRoom = 1.2;    // m, between a floor and what is called a ceiling
constexpr double kCellsMost = 1.0e6;  // of the grid
constexpr double kNearCeiling = 0.5;  // m: cells whose ceilings differ by less have the same

// What tells a ceiling from crowns: it covers much of the area (halls of 0.5 to 0.8, crowns 0.3 to
// 0.7), neighbouring cells have the same (0.8 to 0.95 against 0.2 to 0.6), its surfels are level
// (0.35 to 0.7 against 0.2: any direction).
constexpr double kCoveredShare = 0.4;
constexpr double kSameShare = 0.7;
constexpr double kLevelShare = 0.28;
constexpr double kLevelNormal = 0.8;  // |z| of a level surfel's normal

constexpr float kNone = std::numeric_limits<float>::infinity();

/// The least of each cell's neighbourhood of side 2 `reach` + 1.
std::vector<float> least_around(const std::vector<float>& values,
                                std::size_t columns,
                                std::size_t rows,
                                std::size_t reach) {
  std::vector<float> across(values.size());
  std::vector<float> least(values.size());
  const auto pass = [&](const std::vector<float>& from, std::vector<float>& to, bool along_rows) {
    for (std::size_t y = 0; y < rows; ++y) {
      for (std::size_t x = 0; x < columns; ++x) {
        const std::size_t at = along_rows ? x : y;
        const std::size_t end = std::min(at + reach + 1, along_rows ? columns : rows);
        float found = kNone;
        for (std::size_t i = at - std::min(at, reach); i < end; ++i) {
          found = std::min(found, from[along_rows ? y * columns + i : i * columns + x]);
        }
        to[y * columns + x] = found;
      }
    }
  };
  pass(values, across, true);
  pass(across, least, false);
  return least;
}

}  // namespace

MapLayers::MapLayers(const SurfelMap& map) {
  const Aabb& bounds = map.bounds_world();
  const Vector3d size = bounds.empty() ? Vector3d(1, 1, 1) : bounds.size();
  if (!bounds.empty()) low_ = bounds.min;
  cell_ = std::max({0.5, 4.0 * map.resolution(), std::sqrt(size.x() * size.y() / kCellsMost)});
  while ((size.x() / cell_ + 1.0) * (size.y() / cell_ + 1.0) > 2.0 * kCellsMost) cell_ *= 1.25;
  columns_ = static_cast<std::size_t>(size.x() / cell_) + 1;
  rows_ = static_cast<std::size_t>(size.y() / cell_) + 1;
  find_box(map);
  level_ = std::max({0.2, 2.0 * map.resolution(), (box_.max.z() - box_.min.z()) / (kLevels - 1)});
  fill_columns(map);
  find_ceiling(map);
}

void MapLayers::find_box(const SurfelMap& map) {
  // some are enough
  const auto stride = static_cast<std::uint32_t>(7 + map.surfel_count() / 1000000);
  std::array<std::vector<float>, 3> along;
  map.for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t word) {
    for (std::size_t axis = 0; word % stride == 0 && axis < 3; ++axis) {
      along[axis].push_back(
          static_cast<float>(p[static_cast<int>(axis)] - low_[static_cast<int>(axis)]));
    }
  });
  constexpr double kRoom = 0.15;  // of the size, for what is sparse at the edges
  box_.add(low_);
  box_.add(low_ + Vector3d::Constant(1e-3));
  for (int axis = 0; axis < 3 && !along[0].empty(); ++axis) {
    auto& values = along[static_cast<std::size_t>(axis)];
    std::sort(values.begin(), values.end());
    const std::size_t cut = values.size() / 200;
    const auto low = static_cast<double>(values[cut]);
    const auto high = static_cast<double>(values[values.size() - 1 - cut]);
    const double room = kRoom * (high - low);
    box_.min[axis] = low_[axis] + std::max(static_cast<double>(values.front()), low - room);
    box_.max[axis] = low_[axis] + std::min(static_cast<double>(values.back()), high + room) + 1e-3;
  }
}

std::size_t MapLayers::cell_of(const Vector3d& p) const {
  const auto index = [&](double offset, std::size_t count) {
    const double cell = std::clamp(offset / cell_, 0.0, static_cast<double>(count - 1));
    return static_cast<std::size_t>(cell);
  };
  return index(p.y() - low_.y(), rows_) * columns_ + index(p.x() - low_.x(), columns_);
}

int MapLayers::level_of(double z) const {
  return static_cast<int>(std::clamp((z - box_.min.z()) / level_, 0.0, kLevels - 1.0));
}

void MapLayers::fill_columns(const SurfelMap& map) {
  occupied_.assign(columns_ * rows_, 0);
  floor_.assign(columns_ * rows_, kNone);
  map.for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t word) {
    if (p.z() < box_.min.z()) return;                          // stray
    if (map.notes().opacity(word) == Opacity::kWater) return;  // no ceiling of its bed
    const std::size_t cell = cell_of(p);
    occupied_[cell] |= Column{1} << level_of(p.z());
    floor_[cell] = std::min(floor_[cell], static_cast<float>(p.z()));
  });
  smooth_floor();
}

void MapLayers::smooth_floor() {
  // a low one of the lowest things around: neither roots nor what stands on the floor; then a mean,
  // for floors are smooth
  constexpr double kLow = 0.3;
  const std::vector<float> lowest = floor_;
  const auto around = [&](std::size_t cell, std::size_t reach, const auto& visit) {
    const std::size_t x = cell % columns_;
    const std::size_t y = cell / columns_;
    for (std::size_t j = y - std::min(y, reach); j < std::min(y + reach + 1, rows_); ++j) {
      for (std::size_t i = x - std::min(x, reach); i < std::min(x + reach + 1, columns_); ++i) {
        visit(j * columns_ + i);
      }
    }
  };
  std::vector<float> low(lowest.size(), kNone);
  std::vector<float> near;
  for (std::size_t cell = 0; cell < lowest.size(); ++cell) {
    near.clear();
    around(cell, 3, [&](std::size_t other) {
      if (lowest[other] < kNone) near.push_back(lowest[other]);
    });
    if (near.empty()) continue;
    const auto at =
        near.begin() + static_cast<std::ptrdiff_t>(kLow * static_cast<double>(near.size()));
    std::nth_element(near.begin(), at, near.end());
    low[cell] = *at;
  }
  for (std::size_t cell = 0; cell < low.size(); ++cell) {
    double sum = 0.0;
    double count = 0.0;
    around(cell, 2, [&](std::size_t other) {
      if (low[other] == kNone) return;
      sum += static_cast<double>(low[other]);
      count += 1.0;
    });
    floor_[cell] = count > 0.0 ? static_cast<float>(sum / count) : kNone;
  }
}

int MapLayers::gap_end(Column column) const {
  int widest = 0;
  int end = -1;
  int below = -1;  // the occupied level before
  for (Column rest = column; rest != 0; rest &= rest - 1) {
    const int level = std::countr_zero(rest);
    if (below >= 0 && level - below - 1 > widest) {
      widest = level - below - 1;
      end = level;
    }
    below = level;
  }
  return widest * level_ >= kLeastGap ? end : -1;
}

void MapLayers::find_ceiling(const SurfelMap& map) {
  ceiling_.assign(occupied_.size(), kNone);
  for (std::size_t cell = 0; cell < occupied_.size(); ++cell) {
    const int end = gap_end(occupied_[cell]);
    if (end >= 0) ceiling_[cell] = static_cast<float>(box_.min.z() + end * level_);
  }
  has_ceiling_ = covers_much() && is_level(map);
  // where only the ceiling was seen the neighbours say where it begins
  const auto around = least_around(ceiling_, columns_, rows_, 4);
  for (std::size_t cell = 0; cell < ceiling_.size(); ++cell) {
    if (ceiling_[cell] < kNone || occupied_[cell] == 0) continue;
    const double lowest = box_.min.z() + std::countr_zero(occupied_[cell]) * level_;
    const double begins = static_cast<double>(around[cell]) - kNearCeiling;
    if (lowest >= begins) ceiling_[cell] = static_cast<float>(begins);
  }
}

bool MapLayers::covers_much() const {
  std::size_t seen = 0;
  std::size_t covered = 0;
  std::size_t pairs = 0;
  std::size_t same = 0;
  for (std::size_t cell = 0; cell < occupied_.size(); ++cell) {
    if (occupied_[cell] == 0) continue;
    ++seen;
    if (ceiling_[cell] == kNone) continue;
    if (ceiling_[cell] - floor_[cell] >= static_cast<float>(kLeastRoom)) ++covered;
    if ((cell + 1) % columns_ == 0 || ceiling_[cell + 1] == kNone) continue;
    ++pairs;
    if (std::abs(ceiling_[cell] - ceiling_[cell + 1]) < static_cast<float>(kNearCeiling)) ++same;
  }
  return static_cast<double>(covered) > kCoveredShare * static_cast<double>(seen) &&
         static_cast<double>(same) > kSameShare * static_cast<double>(pairs);
}

bool MapLayers::is_level(const SurfelMap& map) const {
  std::size_t hanging = 0;
  std::size_t level = 0;
  map.for_each_surfel([&](const Vector3d& p, const Vector3d& normal, double, std::uint32_t word) {
    if (static_cast<float>(p.z()) < ceiling_[cell_of(p)]) return;
    if (map.notes().opacity(word) == Opacity::kWater) return;
    ++hanging;
    if (std::abs(normal.z()) > kLevelNormal) ++level;
  });
  return static_cast<double>(level) > kLevelShare * static_cast<double>(hanging);
}

bool MapLayers::is_ceiling(const Vector3d& p_world) const {
  return has_ceiling_ && static_cast<float>(p_world.z()) >= ceiling_[cell_of(p_world)];
}

double MapLayers::floor_at(const Vector3d& p_world) const {
  const float height = floor_[cell_of(p_world)];
  return height < kNone ? static_cast<double>(height) : box_.min.z();
}

}  // namespace pointflight::picture
