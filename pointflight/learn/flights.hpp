#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/learn/range_pattern.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/vehicle/flight_batch.hpp"

namespace pointflight {

/// How flights of a batch go on from one action to the next.
struct FlightsOptions {
  FlightLevel level = FlightLevel::kVelocity;  ///< What actions are.
  double action_period = 0.1;                  ///< s; whole control periods.
  FlightTiming timing;                         ///< Of control and physics.
  /// Collisions are looked for each time that a vehicle at its greatest speed has flown so far, m.
  double look_every = 0.05;
  /// That actions ask for, m/s; 0: the controller's greatest.
  double speed_max = 0.0;
};

/// Many vehicles, each alone in a map of its own or in one that they share: stepped together by
/// actions, with collisions and ranges. Results do not depend on threads, on how many there are, or
/// on the instruction set.
class Flights {
 public:
  /// Clearance is known up to here, m.
  static constexpr double kReach = 1.5;
  /// And exactly below, m.
  static constexpr double kExact = 0.5;

  /// How a flight stands.
  struct Status {
    /// Distance of the hull to the map at the end of the last action, m: exact below `kExact`, a
    /// lower bound beyond, `kReach` at most; minus how deep if it overlaps.
    double clearance = kReach;
    double flown = 0.0;     ///< m since it was placed.
    bool collided = false;  ///< In or before the last action, since it was placed.
  };

  /// `count` vehicles in `map`, the ranges of `pattern`. Throws InputError as `Multirotor`,
  /// std::invalid_argument if the periods do not fit.
  Flights(std::shared_ptr<const SurfelMap> map,
          const VehicleSettings& vehicle,
          std::size_t count,
          const FlightsOptions& options,
          RangePattern pattern);

  /// How many there are.
  [[nodiscard]] std::size_t size() const { return batch_.size(); }
  /// Numbers of one range image.
  [[nodiscard]] std::size_t beams() const { return pattern_.size(); }
  /// As given, with the geometric controller.
  [[nodiscard]] const VehicleSettings& vehicle() const { return batch_.settings(); }

  /// Vehicle `i` begins anew: at rest, hovering. Well below a microsecond.
  void place(std::size_t i, const Vector3d& p_world, double yaw);
  /// The air of a vehicle, until it is placed again.
  void set_wind(std::size_t i, const Vector3d& wind_world);

  /// One action of all vehicles: rows of four, velocity or acceleration ahead, left, up in the
  /// heading's frame and yaw rate, or body rates and thrust; or of a speed for each rotor. SI.
  /// Those with 0 in `moves` stand still; empty: all move. Throws std::invalid_argument if sizes do
  /// not fit.
  void step(std::span<const double> actions,
            std::span<const std::uint8_t> moves,
            const Executor& executor);

  /// Ranges (rows of `beams()`) of these vehicles where they are now.
  void measure(std::span<const std::uint32_t> vehicles,
               std::span<float> ranges,
               const Executor& executor) const;

  /// Where they are.
  [[nodiscard]] RigidBodyState body(std::size_t i) const { return batch_.body(i); }
  /// Heading that its actions are in, rad.
  [[nodiscard]] double yaw(std::size_t i) const { return batch_.yaw(i); }
  /// How it stands.
  [[nodiscard]] const Status& status(std::size_t i) const { return watch_[i].status; }

  /// Positions (world) within `box` that are free of the map by `clearance` (m), above ground by
  /// `heights` (least and greatest, m) where the map has ground below, at random by `seed`: up to
  /// `wanted`, in the order in which they were drawn.
  [[nodiscard]] std::vector<Vector3d> free_positions(const Aabb& box,
                                                     double clearance,
                                                     std::pair<double, double> heights,
                                                     std::size_t wanted,
                                                     std::uint64_t seed) const;

 private:
  /// What is known of a vehicle's surroundings.
  struct Watch {
    Status status;
    double known = 0.0;      ///< Clearance when it was last looked for, m.
    double travelled = 0.0;  ///< Since then, of any point of the hull, m.
    Pose last;               ///< When it was last moved on.
  };
  void ask(std::size_t i, std::span<const double> action);
  void follow(std::size_t i);
  void look(Watch& watch) const;

  std::shared_ptr<const SurfelMap> map_;
  std::unique_ptr<const Renderer> renderer_;
  FlightBatch batch_;
  FlightsOptions options_;
  RangePattern pattern_;
  Solid hull_;
  double hull_radius_ = 0.0;
  int periods_ = 1;  ///< Control periods in an action.
  int looks_ = 1;    ///< For collisions, in an action.
  std::vector<Watch> watch_;
  std::vector<PosePair> poses_;
};

}  // namespace pointflight
