#pragma once

#include <optional>
#include <span>
#include <vector>

#include "pointflight/sim/samples.hpp"

namespace pointflight {

/// Another vehicle or an obstacle at both ends of a step.
struct PlacedBody {
  Label label = kMapLabel;
  const BodyShape* shape = nullptr;
  double radius = 0.0;  ///< `bounding_radius` of the shape.
  Pose before, now;     ///< T_world_body
};

/// What a vehicle knows of its neighbourhood: a value.
struct ProximityState {
  std::optional<Contact> nearest;  ///< At the last step; nothing within the reach.
  double map_distance = 0.0;       ///< To the map, at most the reach.
  std::vector<Label> touching;     ///< In the order in which they were hit.
  Pose T_world_body;               ///< At the last step.
  bool started = false;
};

/// One vehicle's hull against everything, over the step that ends now.
struct ProximityQuery {
  std::uint32_t vehicle = 0;
  Label own_label = kFirstVehicle;
  const Solid* hull = nullptr;
  Pose T_world_body;  ///< Now.
  SimTime now;
  Duration step{0};
  double reach = 10.0;       ///< Distances are known up to here, m.
  bool ignores_map = false;  ///< On the ground, or a wreck.
};

/// Finds what is nearest, and what the hull hit on the way: appends events of what it enters and
/// leaves. Continuous: what lies between the two ends of the step is found too.
void sense_proximity(const ProximityQuery& query,
                     const SurfelMap& map,
                     std::span<const PlacedBody> others,
                     ProximityState& state,
                     std::vector<CollisionEvent>& events);

}  // namespace pointflight
