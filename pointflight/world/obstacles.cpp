#include "pointflight/world/obstacles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/world/obstacle_motion.hpp"
#include "pointflight/world/random_flight.hpp"

namespace pointflight {
namespace {

constexpr Named<ObstacleMotion> kMotions[] = {{ObstacleMotion::kRandom, "random"},
                                              {ObstacleMotion::kStill, "still"},
                                              {ObstacleMotion::kLoop, "loop"},
                                              {ObstacleMotion::kKeyframes, "keyframes"}};
constexpr Named<FlightDirections> kDirections[] = {{FlightDirections::kAny, "any"},
                                                   {FlightDirections::kHorizontal, "horizontal"}};
constexpr Named<AtBorder> kBorders[] = {{AtBorder::kReplace, "replace"},
                                        {AtBorder::kBounce, "bounce"}};
constexpr double kFar = 1e7;          // m
constexpr std::size_t kMost = 50000;  // labels have 16 bits in a scan's file
constexpr Duration kSlice = std::chrono::milliseconds(200);

/// One shape on one motion.
class MovingObstacle : public Obstacle {
 public:
  explicit MovingObstacle(Body body) : body_(std::move(body)) {
    body_.speed_max = speed_max(body_.motion);
  }
  void collect(SimTime /*from*/, SimTime /*until*/, std::vector<Body>& bodies) const override {
    bodies.push_back(body_);
  }

 private:
  Body body_;
};

std::shared_ptr<const SurfelMap> load_cloud(const std::string& path,
                                            double resolution,
                                            const Executor& executor) {
  if (path.ends_with(".pfmap")) return SurfelMap::open(path);
  ImportOptions options;
  options.resolution = resolution;
  const ImportedMap map = import_clouds({path}, options, executor);
  return SurfelMap::from_bytes(map_bytes(map.tree, map.description), path);
}

Motion motion_of(const ObstacleSettings& s, const std::string& folder) {
  if (s.motion == ObstacleMotion::kLoop) return loop_through(s.waypoints, s.speed);
  if (s.motion == ObstacleMotion::kKeyframes)
    return read_keyframes(resolve_path(s.keyframes, folder), s.repeat);
  return PoseTrack(Pose{quaternion_from_rpy(0.0, 0.0, s.yaw_deg * kDegree), s.position});
}

/// What only makes sense together.
void check(const ObstacleSettings& s, const std::function<std::string(const char*)>& location) {
  const auto fail = [&](const char* key, const char* what) {
    throw InputError(fmt::format("{}: {}", location(key), what));
  };
  if (!s.shape && s.file.empty()) fail("file", "shape 'cloud' needs a cloud or mesh");
  if (s.shape && !s.file.empty()) fail("file", "only shape 'cloud' has a file");
  const double radius = std::max(s.size.radius, s.radius_max);
  const char* fault = s.shape ? fault_of_height(**s.shape, s.size.height, radius) : nullptr;
  if (fault != nullptr) fail("height", fault);
  if (s.motion == ObstacleMotion::kLoop && s.waypoints.empty())
    fail("waypoints", "motion 'loop' needs some");
  if (s.motion == ObstacleMotion::kLoop && s.speed <= 0.0)
    fail("speed", "motion 'loop' needs one above 0");
  if (s.motion == ObstacleMotion::kKeyframes && s.keyframes.empty())
    fail("keyframes", "the CSV is missing");
  if (s.motion != ObstacleMotion::kRandom && s.count != 1) {
    fail("count", "only obstacles that move at random come in numbers; write one entry each");
  }
  if (s.radius_max != 0.0 && s.radius_max < s.size.radius) fail("radius_max", "is below radius");
  if (s.speed_max != 0.0 && s.speed_max < s.speed) fail("speed_max", "is below speed");
  if ((s.bounds_max - s.bounds_min).minCoeff() < 0.0) fail("bounds_max", "is below bounds_min");
}

void describe_shape(SettingsVisitor& v, ObstacleSettings& s) {
  const bool is_cloud = !s.shape;
  const SolidKind* kind = is_cloud ? nullptr : &**s.shape;
  describe_solid(v, kind, s.size, 1000.0);
  v.only_if(kind != nullptr && kind->has_radius,
            kinds_with(&SolidKind::has_radius),
            [&](SettingsVisitor& w) {
              w.only_if(s.motion == ObstacleMotion::kRandom, "motion: random", [&](auto& x) {
                x.value({"radius_max", "m", "above radius: each is drawn between the two", 0, 1000},
                        s.radius_max);
              });
            });
  v.only_if(is_cloud, "shape: cloud", [&](SettingsVisitor& w) {
    w.value({"file", "", "cloud, mesh or .pfmap, around its own origin"}, s.file);
    w.only_if(!s.file.ends_with(".pfmap"), "a cloud or mesh as file", [&](SettingsVisitor& x) {
      x.value({"resolution", "m", "at which it is imported", 0.001, 10}, s.resolution);
    });
  });
  v.only_if(!is_cloud, kinds_with(), [&](SettingsVisitor& w) {
    w.value({"intensity", "", "of returns from it", 0, 1e6}, s.intensity);
  });
}

void describe_motion(SettingsVisitor& v, ObstacleSettings& s) {
  v.only_if(s.motion == ObstacleMotion::kRandom || s.motion == ObstacleMotion::kLoop,
            "motion: random, loop",
            [&](SettingsVisitor& w) {
              w.value({"speed", "m/s", "along its way", 0, 100}, s.speed);
            });
  v.only_if(s.motion == ObstacleMotion::kRandom, "motion: random", [&](SettingsVisitor& w) {
    w.value({"count", "", "so many alike; 0: none", 0, 50000}, s.count);
    w.value({"speed_max", "m/s", "above speed: each is drawn between the two", 0, 100},
            s.speed_max);
    w.choice({"directions", "", "of flight"}, s.directions, kDirections);
    w.choice(
        {"at_border",
         "",
         "what happens at the bounds: another one at a random free position, or it turns back"},
        s.at_border,
        kBorders);
    w.value({"bounds_min", "m", "both 0: the map's", -kFar, kFar}, s.bounds_min);
    w.value({"bounds_max", "m", "upper corner", -kFar, kFar}, s.bounds_max);
  });
  v.only_if(s.motion == ObstacleMotion::kStill, "motion: still", [&](SettingsVisitor& w) {
    w.value({"position", "m", "where it stands", -kFar, kFar}, s.position);
    w.value({"yaw_deg", "deg", "how it stands", -360, 360}, s.yaw_deg);
  });
  v.only_if(s.motion == ObstacleMotion::kLoop, "motion: loop", [&](SettingsVisitor& w) {
    w.value({"waypoints", "m", "of the loop, which closes by itself", -kFar, kFar}, s.waypoints);
  });
  v.only_if(s.motion == ObstacleMotion::kKeyframes, "motion: keyframes", [&](SettingsVisitor& w) {
    w.value({"keyframes", "", "CSV: time,x,y,z and roll_deg,pitch_deg,yaw_deg or qw,qx,qy,qz"},
            s.keyframes);
    w.value({"repeat", "", "they start again after the last"}, s.repeat);
  });
}

}  // namespace

void describe(SettingsVisitor& v, ObstacleSettings& s) {
  v.choice({"shape", "", "exact shapes, or the points of a cloud or mesh"}, s.shape, "cloud");
  v.choice({"motion", "", "how it moves: a function of seed and time"}, s.motion, kMotions);
  describe_shape(v, s);
  describe_motion(v, s);
}

Obstacles::Obstacles(const std::vector<ObstacleSettings>& settings,
                     const ObstacleWorld& world,
                     const Executor& executor,
                     std::size_t slices)
    : slices_kept_(slices) {
  if (!world.map || !world.location) throw std::invalid_argument("obstacles need a map and places");
  for (std::size_t entry = 0; entry < settings.size(); ++entry) {
    const ObstacleSettings& s = settings[entry];
    const auto location = [&](const char* key) { return world.location(entry, key); };
    check_settings(s, fmt::format("obstacles[{}]", entry));
    check(s, location);
    std::shared_ptr<const SurfelMap> cloud;
    if (!s.shape) {
      try {
        cloud = load_cloud(resolve_path(s.file, world.folder), s.resolution, executor);
      } catch (const InputError& error) {
        throw InputError(fmt::format("{}: {}", location("file"), error.what()));
      }
    }
    Aabb bounds;
    bounds.min = s.bounds_min;
    bounds.max = s.bounds_max;
    if (s.bounds_min.isZero(0.0) && s.bounds_max.isZero(0.0)) bounds = world.map->bounds_world();
    for (std::int64_t i = 0; i < s.count; ++i) {
      const auto number = static_cast<std::uint32_t>(obstacles_.size());
      if (obstacles_.size() >= kMost) {
        throw InputError(fmt::format("{}: more than {} obstacles", location("count"), kMost));
      }
      if (s.motion == ObstacleMotion::kRandom) {
        obstacles_.push_back(
            std::make_unique<RandomFlight>(s, cloud, bounds, world, number, location("motion")));
        continue;
      }
      Body body;
      body.label = kFirstObstacle + number;
      body.shape = cloud ? BodyShape{cloud} : BodyShape{(*s.shape)->make(s.size)};
      body.intensity = static_cast<float>(s.intensity);
      body.motion = motion_of(s, world.folder);
      obstacles_.push_back(std::make_unique<MovingObstacle>(std::move(body)));
    }
  }
}

std::vector<Body> Obstacles::bodies(SimTime from, SimTime until) const {
  std::vector<Body> bodies;
  bodies.reserve(obstacles_.size());
  const std::lock_guard lock(known_->mutex);  // the motion is worked out as far as needed
  for (const auto& obstacle : obstacles_) {
    obstacle->extend(until);
    obstacle->collect(from, until, bodies);
  }
  return bodies;
}

std::shared_ptr<const Obstacles::Slice> Obstacles::slice(std::int64_t number) const {
  {
    const std::lock_guard lock(known_->mutex);
    const auto found = known_->slices.find(number);
    if (found != known_->slices.end()) return found->second;
  }
  const SimTime from = SimTime{} + number * kSlice;
  std::vector<Body> bodies = this->bodies(from, from + kSlice);
  std::vector<Aabb> boxes;
  boxes.reserve(bodies.size());
  for (const Body& body : bodies) {
    const SimTime first = std::max(from, body.from);
    const SimTime last = std::min(from + kSlice, body.until);
    const SimTime middle = first + (last - first) / 2;
    const double moved = body.speed_max * to_seconds(last - middle);
    const Vector3d half = Vector3d::Constant(bounding_radius(body.shape) + moved);
    const Vector3d center = body.T_world_body(middle).translation;
    boxes.push_back({center - half, center + half});
  }
  auto made = std::make_shared<const Slice>(Slice{std::move(bodies), BoxTree(std::move(boxes))});
  const std::lock_guard lock(known_->mutex);
  known_->slices[number] = made;  // another thread may have made the same
  if (known_->slices.size() > slices_kept_) known_->slices.erase(known_->slices.begin());
  return made;
}

std::vector<Body> Obstacles::near(const Vector3d& position_world,
                                  double reach,
                                  SimTime from,
                                  SimTime until) const {
  std::vector<Body> found;
  if (obstacles_.empty()) return found;
  const std::int64_t first = from.time_since_epoch() / kSlice;
  const std::int64_t last = until.time_since_epoch() / kSlice;
  for (std::int64_t number = first; number <= last; ++number) {
    const auto slice = this->slice(number);
    for (const std::uint32_t i : slice->tree.within(position_world, reach)) {
      found.push_back(slice->bodies[i]);
    }
  }
  if (first == last) return found;
  // one that is there in two slices counts once
  const auto key = [](const Body& body) { return std::pair(body.label, body.from); };
  std::stable_sort(
      found.begin(), found.end(), [&](const Body& a, const Body& b) { return key(a) < key(b); });
  const auto same = [&](const Body& a, const Body& b) { return key(a) == key(b); };
  found.erase(std::unique(found.begin(), found.end(), same), found.end());
  return found;
}

}  // namespace pointflight
