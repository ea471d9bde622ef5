#pragma once

#include <cstdint>
#include <vector>

#include "pointflight/map/surfel_map.hpp"

namespace pointflight::picture {

/// Floor and ceiling over the area of a map, on a grid: what a plan must leave out to show what
/// stands between them.
class MapLayers {
 public:
  /// Looks at all surfels of the map once.
  explicit MapLayers(const SurfelMap& map);

  /// True if something level hangs over most of the area.
  [[nodiscard]] bool has_ceiling() const { return has_ceiling_; }

  /// True for what belongs to the ceiling, or hangs from it.
  [[nodiscard]] bool is_ceiling(const Vector3d& p_world) const;

  /// Height of the floor near a position, m.
  [[nodiscard]] double floor_at(const Vector3d& p_world) const;

  /// What holds nearly all surfels, world, m: stray points do not count.
  [[nodiscard]] const Aabb& box() const { return box_; }

 private:
  /// Heights that are occupied over one cell, a bit each.
  using Column = std::uint64_t;

  void find_box(const SurfelMap& map);
  void fill_columns(const SurfelMap& map);
  void smooth_floor();
  void find_ceiling(const SurfelMap& map);
  [[nodiscard]] bool covers_much() const;
  [[nodiscard]] bool is_level(const SurfelMap& map) const;
  /// Where the ceiling of a column begins, by the widest gap below it; -1: no gap.
  [[nodiscard]] int gap_end(Column column) const;
  [[nodiscard]] std::size_t cell_of(const Vector3d& p_world) const;
  [[nodiscard]] int level_of(double z) const;

  Vector3d low_ = Vector3d::Zero();
  double cell_ = 1.0;   ///< m
  double level_ = 0.2;  ///< m a bit.
  std::size_t columns_ = 1, rows_ = 1;
  Aabb box_;
  std::vector<Column> occupied_;
  std::vector<float> floor_;    ///< m
  std::vector<float> ceiling_;  ///< From here on up it is the ceiling, m.
  bool has_ceiling_ = false;
};

}  // namespace pointflight::picture
