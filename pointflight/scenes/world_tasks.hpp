// What to fly in a world, so that planners can be compared: from where to where, how far that is at
// least, and how narrow.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "pointflight/scenes/scene_space.hpp"

namespace pointflight {

/// Of a task among all of its world.
enum class Difficulty { kEasy, kMedium, kHard };

/// "easy", "medium", "hard".
std::string_view name_of(Difficulty difficulty);

/// Fly from a start to a goal, both at flight height with `kRoomAtEnds` around them.
struct WorldTask {
  static constexpr double kRoomAtEnds = 0.6;  ///< m

  Difficulty difficulty = Difficulty::kEasy;  ///< Among the tasks of its world.
  Vector3d start;                             ///< World, m.
  Vector3d goal;                              ///< World, m.
  double straight = 0.0;                      ///< Distance from one to the other, m.
  /// Of a shortest way at flight height that is free of collisions, m. Found on a grid and then
  /// straightened: the true shortest way may be some 5 per cent shorter.
  double length = 0.0;
  /// Width that the widest way at flight height has at its narrowest, m: nobody gets there through
  /// wider openings. At most twice `SceneSpace::kReach` cells.
  double passage = 0.0;
  /// Corners of a way from start to goal: the shortest one, moved away from what it touches.
  std::vector<Vector3d> way;
};

/// Tasks of a world: `count` of each difficulty, fewer if it has too little room. They are drawn
/// from pairs of positions at random (by `seed`), in the order of length * (length / straight) /
/// passage, one third of the pairs for each difficulty.
std::vector<WorldTask> make_tasks(const SceneSpace& space, std::uint64_t seed, std::size_t count);

}  // namespace pointflight
