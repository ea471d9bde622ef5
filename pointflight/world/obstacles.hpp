#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/settings.hpp"
#include "pointflight/geometry/internal/box_tree.hpp"
#include "pointflight/geometry/solid_kind.hpp"
#include "pointflight/map/body.hpp"

namespace pointflight {

/// How an obstacle moves.
enum class ObstacleMotion {
  kRandom,     ///< Straight, from free position to free position.
  kStill,      ///< Stands at `position`.
  kLoop,       ///< Through `waypoints`, round and round.
  kKeyframes,  ///< As a file says.
};

/// Where random obstacles fly to.
enum class FlightDirections {
  kAny,         ///< All around.
  kHorizontal,  ///< Level.
};

/// What happens to random obstacles at their bounds.
enum class AtBorder {
  kReplace,  ///< Another one appears elsewhere.
  kBounce,   ///< They turn back.
};

/// One entry of a scenario's `obstacles`: one or more bodies alike.
struct ObstacleSettings {
  std::int64_t count = 1;  ///< So many alike; more than one only in random motion.
  /// What it looks like; nothing: the points of `file`.
  std::optional<Choice<SolidKind>> shape = Choice<SolidKind>();
  SolidSize size = {0.3, 1.7, {0.5, 0.5, 0.5}};  ///< Of a solid.
  double radius_max = 0.0;                       ///< Above the radius: drawn between the two.
  std::string file;          ///< Of a cloud, mesh or .pfmap, in the body's own frame.
  double resolution = 0.03;  ///< Of its import, m.
  double intensity = 100.0;  ///< Of the returns of exact shapes.

  ObstacleMotion motion = ObstacleMotion::kRandom;       ///< How it moves.
  double speed = 1.0;                                    ///< m/s
  double speed_max = 0.0;                                ///< Above `speed`: drawn between the two.
  FlightDirections directions = FlightDirections::kAny;  ///< Of random motion.
  AtBorder at_border = AtBorder::kReplace;               ///< What it does there.
  Vector3d bounds_min = Vector3d::Zero();                ///< Both zero: the map's bounds.
  Vector3d bounds_max = Vector3d::Zero();                ///< As bounds_min: world, m.
  Vector3d position = Vector3d::Zero();                  ///< Where a still one stands.
  double yaw_deg = 0.0;             ///< Of a still one, from world x towards y.
  std::vector<Vector3d> waypoints;  ///< Of a loop.
  std::string keyframes;            ///< CSV: `read_keyframes`.
  bool repeat = true;               ///< Keyframes start again after the last.
};

/// The keys of an entry.
void describe(SettingsVisitor& visitor, ObstacleSettings& settings);

/// A position that must be free of obstacles at the start.
struct KeepFree {
  Vector3d center_world;  ///< m
  double radius;          ///< m
};

/// What obstacles are made from.
struct ObstacleWorld {
  std::shared_ptr<const SurfelMap> map;  ///< Never null: where free positions are looked for.
  std::uint64_t seed = 1;                ///< The run's.
  std::vector<KeepFree> keep_free;       ///< Starts of vehicles.
  std::string folder;                    ///< Relative paths are taken from here.
  /// Where a key of entry i stands ("scenario.yaml:12: obstacles[0].radius"), for messages.
  std::function<std::string(std::size_t entry, const char* key)> location;
};

/// One moving thing. Its number within the run is its entity in the random streams.
class Obstacle {
 public:
  virtual ~Obstacle() = default;

  /// Appends its bodies between two instants: usually one, two if it is replaced in between.
  /// Callable from several threads up to the instant of `extend`.
  virtual void collect(SimTime from, SimTime until, std::vector<Body>& bodies) const = 0;

  /// Works out its motion up to an instant.
  virtual void extend(SimTime /*until*/) {}
};

/// All obstacles of a run, in the order of their labels.
class Obstacles {
 public:
  Obstacles() = default;
  /// Reads files, imports clouds, looks for free positions. `near` is quick within the latest
  /// `slices` of 0.2 s that it was asked about. Throws InputError.
  Obstacles(const std::vector<ObstacleSettings>& settings,
            const ObstacleWorld& world,
            const Executor& executor,
            std::size_t slices = 8);

  /// How many there are at any time; what replaces one counts as the same.
  [[nodiscard]] std::size_t size() const { return obstacles_.size(); }

  /// Bodies between two instants. Callable from several threads.
  [[nodiscard]] std::vector<Body> bodies(SimTime from, SimTime until) const;

  /// Those that may come within `reach` of a position between two instants, and perhaps some more,
  /// in the order of their labels. Looks at no others. Callable from several threads.
  [[nodiscard]] std::vector<Body> near(const Vector3d& position_world,
                                       double reach,
                                       SimTime from,
                                       SimTime until) const;

 private:
  /// All bodies of a slice of time, and where each can be in it.
  struct Slice {
    std::vector<Body> bodies;
    BoxTree tree;
  };
  /// What is worked out as time goes on; functions of the obstacles, so that all may share it.
  struct Known {
    std::mutex mutex;
    std::map<std::int64_t, std::shared_ptr<const Slice>> slices;
  };
  [[nodiscard]] std::shared_ptr<const Slice> slice(std::int64_t number) const;

  std::vector<std::unique_ptr<Obstacle>> obstacles_;
  std::size_t slices_kept_ = 8;
  std::unique_ptr<Known> known_ = std::make_unique<Known>();
};

}  // namespace pointflight
