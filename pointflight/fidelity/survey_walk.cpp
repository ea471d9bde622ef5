#include "pointflight/fidelity/survey_walk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/scenes/scene_tree.hpp"

namespace pointflight {
namespace {

constexpr double kWalkFree = 0.4;   // m around the sensor on its way
constexpr double kPlaceFree = 0.3;  // m around a position to look from
constexpr std::size_t kLooks = 200;
constexpr double kStep = 0.2;     // m between positions of a leg that are looked at
constexpr double kLegMin = 2.0;   // m
constexpr double kLegMax = 15.0;  // m
constexpr double kSway = 3.0 * kDegree;
constexpr double kSwayPeriod = 1.7;  // s
constexpr double kTurnRate = 1.0;    // rad/s

bool is_free_leg(const SceneTree& tree, const Vector3d& from, const Vector3d& to) {
  const double length = (to - from).norm();
  const Vector3d d = (to - from) / length;
  const auto ahead = tree.intersect(from, d);
  if (ahead && ahead->range < length + kWalkFree) return false;
  for (double at = kStep; at < length; at += kStep) {
    if (!tree.is_free(from + at * d, kWalkFree, kLooks)) return false;
  }
  return true;
}

Aabb bounds_of(const ExactScene& scene) {
  Aabb box;
  for (const Shape& shape : scene.geometry.shapes) {
    const Aabb own = bounds(shape);
    box.add(own.min);
    box.add(own.max);
  }
  return box;
}

/// Straight legs through free positions.
class Way {
 public:
  Way(const ExactScene& scene, const SceneTree& tree, const SurveyOptions& options)
      : tree_(tree), random_(options.seed, StreamId::kSurvey, survey_draws::kWay) {
    const Aabb box = bounds_of(scene);
    constexpr std::uint64_t kTries = 20000;
    constexpr std::size_t kPlaces = 80;
    for (std::uint64_t i = 0; i < kTries && places_.size() < kPlaces; ++i) {
      if (const auto place = place_in(box, i)) places_.push_back(*place);
    }
    if (places_.empty()) {
      throw InputError(
          fmt::format("scene '{}': no place to walk, 1.2 to 1.8 m above something and {} m from "
                      "everything",
                      scene.name,
                      kWalkFree));
    }
  }

  /// Corners of a walk of at least `length` m, or the only position that can be stood at.
  [[nodiscard]] std::vector<Vector3d> corners(double length) const {
    std::vector<Vector3d> best;
    double best_length = -1.0;
    constexpr std::size_t kStarts = 8;
    for (std::size_t start = 0; start < std::min(kStarts, places_.size()); ++start) {
      std::vector<Vector3d> way = {places_[start]};
      const double walked = walk(start, length, way);
      if (walked > best_length) best = way;
      best_length = std::max(best_length, walked);
      if (best_length >= length) break;
    }
    return best;
  }

 private:
  [[nodiscard]] std::optional<Vector3d> place_in(const Aabb& box, std::uint64_t i) const {
    const auto [u, v] = random_.uniform2(2 * i);
    const auto [w, h] = random_.uniform2(2 * i + 1);
    const Vector3d size = box.size();
    // from somewhere in the lower part, down to what is below
    const Vector3d from = box.min + size.cwiseProduct(Vector3d(u, v, 0.0)) +
                          Vector3d(0, 0, w * std::clamp(size.z(), 0.5, 4.0));
    const auto below = tree_.intersect(from, -Vector3d::UnitZ());
    if (!below) return std::nullopt;
    Vector3d place = from;
    place.z() += 1.2 + 0.6 * h - below->range;
    const auto above = tree_.intersect(from, Vector3d::UnitZ());
    if (above && above->range < place.z() - from.z() + kWalkFree) return std::nullopt;
    if (!tree_.is_free(place, kWalkFree, kLooks)) return std::nullopt;
    return place;
  }

  /// To the position that was visited least among those in reach, the nearest first.
  double walk(std::size_t at, double length, std::vector<Vector3d>& way) const {
    std::vector<int> visits(places_.size(), 0);
    std::vector<std::int8_t> legs(places_.size() * places_.size(), -1);
    double walked = 0.0;
    visits[at] = 1;
    while (walked < length) {
      std::vector<std::pair<double, std::size_t>> order;
      for (std::size_t i = 0; i < places_.size(); ++i) {
        const double far = (places_[i] - places_[at]).norm();
        if (i == at || far < kLegMin || far > kLegMax) continue;
        order.emplace_back(far + 20.0 * visits[i], i);
      }
      std::sort(order.begin(), order.end());
      std::size_t next = at;
      for (const auto& [cost, i] : order) {
        std::int8_t& known = legs[at * places_.size() + i];
        if (known < 0) known = is_free_leg(tree_, places_[at], places_[i]) ? 1 : 0;
        if (known == 0) continue;
        next = i;
        break;
      }
      if (next == at) break;
      walked += (places_[next] - places_[at]).norm();
      at = next;
      ++visits[at];
      way.push_back(places_[at]);
    }
    return walked;
  }

  const SceneTree& tree_;
  RandomStream random_;
  std::vector<Vector3d> places_;
};

}  // namespace

std::vector<TimedPose> make_walk(const ExactScene& scene,
                                 const SceneTree& tree,
                                 const SurveyOptions& options,
                                 Duration scan_period) {
  const std::vector<Vector3d> corners =
      options.way.empty() ? Way(scene, tree, options).corners(options.seconds * options.speed)
                          : options.way;
  std::vector<double> reached = {0.0};  // s
  for (std::size_t i = 1; i < corners.size(); ++i) {
    reached.push_back(reached.back() + (corners[i] - corners[i - 1]).norm() / options.speed);
  }
  std::vector<TimedPose> walk;
  const auto count = static_cast<std::size_t>(options.seconds / to_seconds(scan_period)) + 1;
  double yaw = 0.0;
  std::size_t leg = 1;
  for (std::size_t i = 0; i < count; ++i) {
    const SimTime time = SimTime(static_cast<std::int64_t>(i) * scan_period);
    const double t = to_seconds(time);
    while (leg < corners.size() && reached[leg] < t) ++leg;
    Vector3d place = corners.back();
    if (leg < corners.size()) {
      const double share = (t - reached[leg - 1]) / (reached[leg] - reached[leg - 1]);
      const Vector3d d = corners[leg] - corners[leg - 1];
      place = corners[leg - 1] + share * d;
      const double turn = wrap_angle(math::atan2(d.y(), d.x()) - yaw);
      const double most = i == 0 ? kPi : kTurnRate * to_seconds(scan_period);
      yaw = wrap_angle(yaw + std::clamp(turn, -most, most));
    }
    const auto sway = math::sincos(2.0 * kPi * t / kSwayPeriod);
    walk.push_back(
        {time,
         {quaternion_from_rpy(kSway * sway.sin, options.tilt_deg * kDegree + kSway * sway.cos, yaw),
          place}});
  }
  return walk;
}

std::vector<Pose> places_near(const ExactScene& scene,
                              const SceneTree& tree,
                              const std::vector<TimedPose>& walk,
                              std::size_t count,
                              std::uint64_t seed) {
  const RandomStream random(seed, StreamId::kSurvey, survey_draws::kPlaces);
  constexpr std::uint64_t kTries = 20000;
  std::vector<Pose> places;
  for (std::uint64_t i = 0; i < kTries && places.size() < count; ++i) {
    const auto [at, angle] = random.uniform2(2 * i);
    const auto [far, turn] = random.uniform2(2 * i + 1);
    const auto step = static_cast<std::size_t>(at * static_cast<double>(walk.size()));
    const auto way = math::sincos(2.0 * kPi * angle);
    const double up = random.uniform(2 * (kTries + i)) - 0.5;
    const Vector3d from = walk[step].pose.translation;
    const Vector3d beside = Vector3d(way.cos, way.sin, 0.0) * (0.5 + far) + Vector3d(0, 0, up);
    const auto met = tree.intersect(from, beside.normalized());
    if (met && met->range < beside.norm()) continue;
    if (!tree.is_free(from + beside, kPlaceFree, kLooks)) continue;
    places.push_back({quaternion_from_rpy(0, 0, 2.0 * kPi * turn), from + beside});
  }
  if (places.size() < count) {
    throw InputError(fmt::format("scene '{}': no {} places beside the walk with {} m around them",
                                 scene.name,
                                 count,
                                 kPlaceFree));
  }
  return places;
}

}  // namespace pointflight
