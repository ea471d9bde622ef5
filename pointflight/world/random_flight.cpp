#include "pointflight/world/random_flight.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"

namespace pointflight {
namespace {

// draws of one life: a number each
constexpr std::uint64_t kSizeDraw = 0;
constexpr std::uint64_t kDirectionDraw = 1;
constexpr std::uint64_t kSpeedDraw = 2;
constexpr std::uint64_t kPlaceDraws = 16;  // two a try
constexpr std::uint64_t kTries = 1000;
constexpr std::uint64_t kDrawsALife = 1u << 12;
static_assert(kPlaceDraws + 2 * kTries < kDrawsALife);
constexpr Duration kShortestLife =
    std::chrono::milliseconds(1);  // for bounds that are all but flat

double drawn(double low, double high, double share) {
  return high > low ? low + share * (high - low) : low;
}

}  // namespace

RandomFlight::RandomFlight(const ObstacleSettings& settings,
                           std::shared_ptr<const SurfelMap> cloud,
                           const Aabb& bounds,
                           const ObstacleWorld& world,
                           std::uint32_t number,
                           const std::string& location)
    : settings_(settings),
      cloud_(std::move(cloud)),
      bounds_(bounds),
      map_(world.map),
      keep_free_(world.keep_free),
      random_(world.seed, StreamId::kObstacles, number),
      label_(kFirstObstacle + number),
      location_(location) {
  lives_.push_back(life(0, SimTime{}, true));
}

Vector3d RandomFlight::free_position(std::uint64_t n, double radius, bool strict) const {
  Vector3d best = bounds_.min;
  double best_room = -1.0;
  for (std::uint64_t attempt = 0; attempt < kTries; ++attempt) {
    const std::uint64_t index = n * kDrawsALife + kPlaceDraws + 2 * attempt;
    const auto [u, v] = random_.uniform2(index);
    const double w = random_.uniform(index + 1);
    const Vector3d p = bounds_.min + Vector3d(u, v, w).cwiseProduct(bounds_.size());
    const auto nearest = map_->nearest(p, radius);
    const bool kept_free =
        n == 0 && std::any_of(keep_free_.begin(), keep_free_.end(), [&](const KeepFree& keep) {
          return (p - keep.center_world).norm() < keep.radius + radius;
        });
    if (!nearest && !kept_free) return p;
    // later lives take the roomiest: a run does not end because a map is full
    if (nearest && nearest->distance > best_room) {
      best_room = nearest->distance;
      best = p;
    }
  }
  if (strict) {
    throw InputError(fmt::format(
        "{}: no free position for an obstacle that reaches {:.2f} m to all sides was found "
        "within ({:.1f}, {:.1f}, {:.1f}) to ({:.1f}, {:.1f}, {:.1f}) in {} tries; make it "
        "smaller, or give bounds_min and bounds_max",
        location_,
        radius,
        bounds_.min.x(),
        bounds_.min.y(),
        bounds_.min.z(),
        bounds_.max.x(),
        bounds_.max.y(),
        bounds_.max.z(),
        kTries));
  }
  return best;
}

RandomFlight::Life RandomFlight::life(std::uint64_t n, SimTime from, bool strict) const {
  const std::uint64_t base = n * kDrawsALife;
  Life life;
  life.from = n == 0 ? SimTime::min() : from;
  const double radius =
      drawn(settings_.size.radius, settings_.radius_max, random_.uniform(base + kSizeDraw));
  if (cloud_) {
    life.shape = cloud_;
  } else {
    SolidSize size = settings_.size;
    size.radius = radius;
    life.shape = (*settings_.shape)->make(size);
  }
  life.start = free_position(n, bounding_radius(life.shape), strict);

  const auto [u, v] = random_.uniform2(base + kDirectionDraw);
  const double z = settings_.directions == FlightDirections::kHorizontal ? 0.0 : 2.0 * u - 1.0;
  const double side = std::sqrt(1.0 - z * z);
  const auto angle = math::sincos(2.0 * kPi * v);
  const double speed =
      drawn(settings_.speed, settings_.speed_max, random_.uniform(base + kSpeedDraw));
  life.velocity = speed * Vector3d(side * angle.cos, side * angle.sin, z);
  for (int axis = 0; axis < 3; ++axis) {
    if (bounds_.size()[axis] <= 0.0) life.velocity[axis] = 0.0;  // in flat bounds it stays in them
  }

  life.until = SimTime::max();
  if (settings_.at_border == AtBorder::kBounce) return life;
  for (int axis = 0; axis < 3; ++axis) {
    const double rate = life.velocity[axis];
    if (rate == 0.0) continue;
    const double border = rate > 0.0 ? bounds_.max[axis] : bounds_.min[axis];
    const double seconds = (border - life.start[axis]) / rate;
    if (seconds < 1e9) {
      life.until = std::min(life.until, from + std::max(from_seconds(seconds), kShortestLife));
    }
  }
  return life;
}

void RandomFlight::extend(SimTime until) {
  while (lives_.back().until <= until) {
    lives_.push_back(life(lives_.size(), lives_.back().until, false));
  }
}

void RandomFlight::collect(SimTime from, SimTime until, std::vector<Body>& bodies) const {
  const auto first =
      std::upper_bound(lives_.begin(), lives_.end(), from, [](SimTime t, const Life& life) {
        return t < life.until;
      });
  for (auto life = first; life != lives_.end() && life->from <= until; ++life) {
    Body body;
    body.label = label_;
    body.shape = life->shape;
    body.intensity = static_cast<float>(settings_.intensity);
    body.speed_max = life->velocity.norm();
    body.from = life->from;
    body.until = life->until;
    StraightMotion motion;
    motion.from = life->from == SimTime::min() ? SimTime{} : life->from;
    motion.start = life->start;
    motion.velocity = life->velocity;
    if (settings_.at_border == AtBorder::kBounce) motion.walls = bounds_;
    body.motion = motion;
    bodies.push_back(std::move(body));
  }
}

}  // namespace pointflight
