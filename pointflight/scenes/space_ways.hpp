#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "pointflight/scenes/scene_space.hpp"

namespace pointflight {

/// The part of a space at flight height as a graph: shortest and widest ways from a cell. Cells
/// have numbers in it, from 0 on.
class SpaceWays {
 public:
  /// The cost of what cannot be reached.
  static constexpr std::uint32_t kUnreached = std::numeric_limits<std::uint32_t>::max();
  /// Cost of a step to the next cell along an axis; others cost what they are longer, rounded.
  static constexpr std::uint32_t kStep = 20;

  /// The space must outlive it.
  explicit SpaceWays(const SceneSpace& space);

  /// Index in the space of each cell, by number.
  [[nodiscard]] const std::vector<std::uint32_t>& cells() const { return cells_; }

  /// Number of the cell at a position (world, m); `kUnreached` if it is not at flight height.
  [[nodiscard]] std::uint32_t number_at(const Vector3d& p_world) const;

  /// Costs to all cells from one of them; `limit`: farther ones are left out.
  [[nodiscard]] std::vector<std::uint32_t> shortest_from(std::uint32_t from,
                                                         std::uint32_t limit = kUnreached -
                                                                               1) const;

  /// Of each cell the room (m) that the widest way from one of them has at its narrowest; negative
  /// if there is no way.
  [[nodiscard]] std::vector<float> widest_from(std::uint32_t from) const;

  /// Centres (world, m) of the cells of a shortest way, by the costs from its start.
  [[nodiscard]] std::vector<Vector3d> way_back(const std::vector<std::uint32_t>& cost,
                                               std::uint32_t to) const;

 private:
  template <class Visit>
  void for_neighbours(std::uint32_t at, const Visit& visit) const;

  const SceneSpace& space_;
  std::vector<std::uint32_t> cells_;   ///< Of the space, in order.
  std::vector<std::uint32_t> number_;  ///< Of each cell of the space.
};

/// Leaves out corners between which a straight line has room enough for what flies.
std::vector<Vector3d> straightened(const SceneSpace& space, const std::vector<Vector3d>& way);

/// Moves the corners between the ends away from surfaces, as far as that gives the legs beside them
/// more room, up to `room` (m): a shortest way touches every edge that it turns around.
std::vector<Vector3d> with_room(const SceneSpace& space, std::vector<Vector3d> way, double room);

}  // namespace pointflight
