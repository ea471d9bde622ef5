#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// How high the ground is under each position of a streamed cloud: the lowest points of each
/// column, without strays below, opened by a window (Zhang et al. 2003, with one window): what is
/// narrower than the window and stands on the ground is no ground. Memory grows with the area, at
/// most 1 GB: then columns grow.
class GroundHeight {
 public:
  /// `window`: width of the widest thing that hides the ground, m.
  explicit GroundHeight(double window = 12.0, double column = 1.0);

  /// Adds a finite point of the world, m.
  void add(const Vector3d& point);

  /// To be called once, when all points are there. Throws InputError if there were none.
  void finish();

  /// Height of the ground under a position; that of the nearest column if the position has none.
  [[nodiscard]] double at(double x, double y) const;

 private:
  static constexpr std::size_t kLowest = 12;  ///< Heights that a column keeps.
  static constexpr std::size_t kMostColumns = 1 << 23;

  struct Cell {
    std::int32_t x, y;
    bool operator==(const Cell&) const = default;
  };
  struct HashCell {
    std::size_t operator()(const Cell& cell) const;
  };
  struct Column {
    std::array<float, kLowest> lowest{};  ///< Ascending.
    std::uint32_t count = 0;
    void add(float z);
    void add(const Column& other);
    [[nodiscard]] float low() const;
  };
  using Heights = std::unordered_map<Cell, float, HashCell>;

  [[nodiscard]] Cell cell_of(double x, double y) const;
  void widen_columns();
  static Heights without_pits(const Heights& heights);
  static Heights along(const Heights& heights, bool along_x, std::int32_t reach, bool highest);

  double window_;
  double column_;
  std::unordered_map<Cell, Column, HashCell> columns_;
  Heights ground_;
  float usual_ = 0.0f;  ///< Median, for positions far from all columns.
};

}  // namespace pointflight
