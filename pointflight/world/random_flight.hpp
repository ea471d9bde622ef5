#pragma once

#include <vector>

#include "pointflight/core/random.hpp"
#include "pointflight/world/obstacles.hpp"

namespace pointflight {

/// The paper's dynamic obstacle (section IV.E): constant velocity in a random direction; outside
/// the bounds it is replaced at a random free position, with a new size, direction and speed.
/// "bounce" turns it back at the bounds instead.
class RandomFlight : public Obstacle {
 public:
  /// `settings` of the entry, `bounds` already decided. Throws InputError if no free position is
  /// found at the start; `location` says where the entry stands.
  RandomFlight(const ObstacleSettings& settings,
               std::shared_ptr<const SurfelMap> cloud,
               const Aabb& bounds,
               const ObstacleWorld& world,
               std::uint32_t number,
               const std::string& location);

  void collect(SimTime from, SimTime until, std::vector<Body>& bodies) const override;
  void extend(SimTime until) override;

 private:
  /// From its appearance until it leaves.
  struct Life {
    SimTime from, until;
    BodyShape shape;
    Vector3d start;
    Vector3d velocity;
  };
  /// Life number n, which starts at `from`; `strict`: throws if no position is free.
  [[nodiscard]] Life life(std::uint64_t n, SimTime from, bool strict) const;
  [[nodiscard]] Vector3d free_position(std::uint64_t n, double radius, bool strict) const;

  ObstacleSettings settings_;
  std::shared_ptr<const SurfelMap> cloud_;
  Aabb bounds_;
  std::shared_ptr<const SurfelMap> map_;
  std::vector<KeepFree> keep_free_;
  RandomStream random_;
  Label label_;
  std::string location_;
  std::vector<Life> lives_;
};

}  // namespace pointflight
