#include "pointflight/sim/internal/proximity.hpp"

#include <algorithm>

#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

/// A contact within the step.
struct Meeting {
  double share;  ///< Of the step.
  Contact contact;
};

/// The first contact on the way between both ends of the step. `contact_at(share)` is the contact
/// there, nothing if it is farther than `moved`.
template <class ContactAt>
std::optional<Meeting> meeting_on_the_way(const ContactAt& contact_at, double moved) {
  std::optional<Contact> last;
  const auto distance_at = [&](double share) {
    last = contact_at(share);
    return last ? last->distance : 2.0 * moved + 1.0;
  };
  const auto share = first_contact(distance_at, moved);
  if (!share) return std::nullopt;
  return Meeting{*share, *last};
}

class Sensing {
 public:
  Sensing(const ProximityQuery& query, ProximityState& state, std::vector<CollisionEvent>& events)
      : query_(query),
        state_(state),
        events_(events),
        before_(state.started ? state.T_world_body : query.T_world_body),
        own_moved_(motion_bound(before_, query.T_world_body, bounding_radius(*query.hull))) {}

  void sense_map(const SurfelMap& map) {
    const auto now = contact_with_map(map, *query_.hull, query_.T_world_body, query_.reach);
    nearest_ = now;
    const double distance = now ? now->distance : query_.reach;
    const bool may_touch =
        !state_.started || distance <= 0.0 || state_.map_distance + distance <= own_moved_;
    state_.map_distance = distance;
    if (query_.ignores_map || !may_touch) return;
    const auto contact_at = [&](double share) {
      const Pose pose = interpolate(before_, query_.T_world_body, share);
      return contact_with_map(map, *query_.hull, pose, own_moved_);
    };
    meet(kMapLabel, now, contact_at, own_moved_);
  }

  void sense_body(const PlacedBody& body) {
    const double moved = own_moved_ + motion_bound(body.before, body.now, body.radius) + 1e-9;
    const double known = nearest_ ? nearest_->distance : query_.reach;
    const double reach = std::max(known, moved);
    const auto now = contact_with_body(
        *body.shape, body.now, body.label, *query_.hull, query_.T_world_body, reach);
    if (!now) return;
    if (now->distance < known) nearest_ = now;
    if (now->distance > moved) return;
    const auto contact_at = [&](double share) {
      return contact_with_body(*body.shape,
                               interpolate(body.before, body.now, share),
                               body.label,
                               *query_.hull,
                               interpolate(before_, query_.T_world_body, share),
                               moved);
    };
    meet(body.label, now, contact_at, moved);
  }

  void finish() {
    for (const Label label : state_.touching) {
      if (std::find(touching_.begin(), touching_.end(), label) != touching_.end()) continue;
      CollisionEvent event = event_of(label, query_.now);
      event.entered = false;
      events_.push_back(event);
    }
    state_.touching = std::move(touching_);
    state_.nearest = nearest_;
    state_.T_world_body = query_.T_world_body;
    state_.started = true;
  }

 private:
  [[nodiscard]] CollisionEvent event_of(Label partner, SimTime time) const {
    CollisionEvent event;
    event.vehicle = query_.vehicle;
    event.partner = partner;
    event.time = time;
    event.vehicle_world = query_.T_world_body.translation;
    if (nearest_) event.position_world = nearest_->position_world;
    return event;
  }

  /// Notes a partner that is touched now or was on the way.
  template <class ContactAt>
  void meet(Label label,
            const std::optional<Contact>& now,
            const ContactAt& contact_at,
            double moved) {
    const bool inside = now && now->distance <= 0.0;
    const bool known =
        std::find(state_.touching.begin(), state_.touching.end(), label) != state_.touching.end();
    if (known) {
      if (inside) touching_.push_back(label);
      return;
    }
    std::optional<Meeting> meeting;
    if (moved > 0.0) meeting = meeting_on_the_way(contact_at, moved);
    if (!meeting && inside) meeting = Meeting{1.0, *now};
    if (!meeting) return;
    touching_.push_back(label);
    const Duration late = from_seconds((1.0 - meeting->share) * to_seconds(query_.step));
    CollisionEvent event = event_of(label, state_.started ? query_.now - late : query_.now);
    event.vehicle_world = interpolate(before_, query_.T_world_body, meeting->share).translation;
    event.position_world = meeting->contact.position_world;
    event.penetration = inside ? -now->distance : 0.0;
    events_.push_back(event);
  }

  const ProximityQuery& query_;
  ProximityState& state_;
  std::vector<CollisionEvent>& events_;
  Pose before_;
  double own_moved_;
  std::optional<Contact> nearest_;
  std::vector<Label> touching_;
};

}  // namespace

void sense_proximity(const ProximityQuery& query,
                     const SurfelMap& map,
                     std::span<const PlacedBody> others,
                     ProximityState& state,
                     std::vector<CollisionEvent>& events) {
  Sensing sensing(query, state, events);
  sensing.sense_map(map);
  for (const PlacedBody& body : others) {
    if (body.label != query.own_label) sensing.sense_body(body);
  }
  sensing.finish();
}

}  // namespace pointflight
