#include "pointflight/map/ground_height.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "pointflight/core/hash.hpp"
#include "pointflight/core/input_error.hpp"

namespace pointflight {

GroundHeight::GroundHeight(double window, double column) : window_(window), column_(column) {
  if (!(window > 0.0) || !(column > 0.0) || !std::isfinite(window) || !std::isfinite(column)) {
    throw InputError("the window and the columns of the ground have to be wider than 0 m");
  }
}

std::size_t GroundHeight::HashCell::operator()(const Cell& cell) const {
  const auto part = [](std::int32_t v) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(v));
  };
  return scatter64(part(cell.x) << 32 | part(cell.y));
}

void GroundHeight::Column::add(float z) {
  std::size_t at = std::min<std::size_t>(count, kLowest);
  ++count;
  if (at == kLowest && !(z < lowest.back())) return;
  if (at == kLowest) --at;
  for (; at > 0 && z < lowest[at - 1]; --at) lowest[at] = lowest[at - 1];
  lowest[at] = z;
}

void GroundHeight::Column::add(const Column& other) {
  const std::uint32_t together = count + other.count;
  for (std::size_t i = 0; i < std::min<std::size_t>(other.count, kLowest); ++i) {
    add(other.lowest[i]);
  }
  count = together;
}

/// The lowest but one in sixty: reflections lie below the floor.
float GroundHeight::Column::low() const {
  return lowest[std::min<std::size_t>(kLowest - 1, count / 60)];
}

GroundHeight::Cell GroundHeight::cell_of(double x, double y) const {
  const auto index = [this](double v) {
    constexpr double kMost = 2e9;
    return static_cast<std::int32_t>(std::clamp(std::floor(v / column_), -kMost, kMost));
  };
  return {index(x), index(y)};
}

void GroundHeight::add(const Vector3d& point) {
  columns_[cell_of(point.x(), point.y())].add(static_cast<float>(point.z()));
  if (columns_.size() > kMostColumns) widen_columns();
}

void GroundHeight::widen_columns() {
  std::unordered_map<Cell, Column, HashCell> wider;
  for (const auto& [cell, column] : columns_) wider[{cell.x >> 1, cell.y >> 1}].add(column);
  columns_ = std::move(wider);
  column_ *= 2.0;
}

/// A column far below most of those around it is a pit that nothing but strays made.
GroundHeight::Heights GroundHeight::without_pits(const Heights& heights) {
  constexpr float kDeepest = 1.0f;  // m below the lower quarter
  Heights filled;
  filled.reserve(heights.size());
  std::vector<float> around;
  for (const auto& [cell, height] : heights) {
    around.clear();
    for (std::int32_t dx = -2; dx <= 2; ++dx) {
      for (std::int32_t dy = -2; dy <= 2; ++dy) {
        const auto found = heights.find({cell.x + dx, cell.y + dy});
        if (found != heights.end()) around.push_back(found->second);
      }
    }
    const auto quarter = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 4);
    std::nth_element(around.begin(), quarter, around.end());
    filled[cell] = height < *quarter - kDeepest ? *quarter : height;
  }
  return filled;
}

GroundHeight::Heights GroundHeight::along(const Heights& heights,
                                          bool along_x,
                                          std::int32_t reach,
                                          bool highest) {
  Heights result;
  result.reserve(heights.size());
  const auto height_at = [&](const Cell& cell, std::int32_t d) {
    const auto found = heights.find(along_x ? Cell{cell.x + d, cell.y} : Cell{cell.x, cell.y + d});
    return found == heights.end() ? std::numeric_limits<float>::quiet_NaN() : found->second;
  };
  for (const auto& [cell, height] : heights) {
    float best = height;
    for (std::int32_t d = 1; d <= reach; ++d) {
      float before = height_at(cell, -d);
      float behind = height_at(cell, d);
      if (std::isnan(before) && std::isnan(behind)) continue;
      // beyond the border a slope goes on as it came
      if (std::isnan(before)) before = 2.0f * height - behind;
      if (std::isnan(behind)) behind = 2.0f * height - before;
      best = highest ? std::max({best, before, behind}) : std::min({best, before, behind});
    }
    result[cell] = best;
  }
  return result;
}

void GroundHeight::finish() {
  if (columns_.empty()) throw InputError("no points to tell the ground by");
  for (const auto& [cell, column] : columns_) ground_[cell] = column.low();
  columns_.clear();
  ground_ = without_pits(ground_);
  // an opening: erosion by the window, then dilation; a slope stays what it is
  const auto reach =
      static_cast<std::int32_t>(std::clamp(std::ceil(0.5 * window_ / column_), 1.0, 1000.0));
  for (const bool highest : {false, true}) {
    for (const bool along_x : {true, false}) ground_ = along(ground_, along_x, reach, highest);
  }
  std::vector<float> all;
  all.reserve(ground_.size());
  for (const auto& [cell, height] : ground_) all.push_back(height);
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end());
  usual_ = *middle;
}

double GroundHeight::at(double x, double y) const {
  constexpr std::int32_t kFarthest = 20;  // columns
  const Cell cell = cell_of(x, y);
  for (std::int32_t ring = 0; ring <= kFarthest; ++ring) {
    float lowest = std::numeric_limits<float>::infinity();
    for (std::int32_t dx = -ring; dx <= ring; ++dx) {
      const std::int32_t step = std::abs(dx) == ring || ring == 0 ? 1 : 2 * ring;
      for (std::int32_t dy = -ring; dy <= ring; dy += step) {
        const auto found = ground_.find({cell.x + dx, cell.y + dy});
        if (found != ground_.end()) lowest = std::min(lowest, found->second);
      }
    }
    if (std::isfinite(lowest)) return static_cast<double>(lowest);
  }
  return static_cast<double>(usual_);
}

}  // namespace pointflight
