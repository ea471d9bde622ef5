#include "pointflight/learn/traffic.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "pointflight/world/contact.hpp"

namespace pointflight {

Traffic::Traffic(std::shared_ptr<const Obstacles> obstacles, Body vehicle)
    : obstacles_(std::move(obstacles)),
      vehicle_(std::move(vehicle)),
      hull_(std::get<Solid>(vehicle_.shape)),
      hull_radius_(bounding_radius(hull_)) {}

double Traffic::clearance(std::span<const Pose> team,
                          std::size_t own,
                          SimTime time,
                          double reach) const {
  double least = reach;
  const auto take = [&](const BodyShape& shape, const Pose& at, Label label) {
    const auto contact = contact_with_body(shape, at, label, hull_, team[own], reach);
    if (contact) least = std::min(least, contact->distance);
  };
  if (obstacles_) {
    const double radius = hull_radius_ + reach;
    for (const Body& body : obstacles_->near(team[own].translation, radius, time, time)) {
      if (body.from <= time && time < body.until) {
        take(body.shape, body.T_world_body(time), body.label);
      }
    }
  }
  for (std::size_t i = 0; i < team.size(); ++i) {
    if (i != own) take(hull_, team[i], kFirstVehicle + static_cast<Label>(i));
  }
  return least;
}

std::vector<Body> Traffic::bodies(std::span<const PosePair> team,
                                  std::size_t own,
                                  double range_max) const {
  std::vector<Body> bodies;
  const PosePair& from = team[own];
  if (obstacles_) {
    const double moved = (from.now.translation - from.before.translation).norm();
    bodies = obstacles_->near(from.now.translation, range_max + moved, from.before_time, from.time);
  }
  for (std::size_t i = 0; i < team.size(); ++i) {
    if (i == own) continue;
    const PosePair& at = team[i];
    Body body = vehicle_;
    body.label = kFirstVehicle + static_cast<Label>(i);
    if (at.before_time < at.time) {
      body.motion = PoseTrack({{at.before_time, at.before}, {at.time, at.now}});
      body.speed_max = (at.now.translation - at.before.translation).norm() /
                       to_seconds(at.time - at.before_time);
    } else {
      body.motion = PoseTrack(at.now);
    }
    bodies.push_back(std::move(body));
  }
  return bodies;
}

}  // namespace pointflight
