#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/learn/range_pattern.hpp"
#include "pointflight/learn/traffic.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/vehicle/flight_batch.hpp"
#include "pointflight/world/obstacles.hpp"
#include "pointflight/world/wind.hpp"

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
  /// Vehicles 0 to team - 1 are together in their map, see and hit each other, and so are the next
  /// ones: 1, 2, 4 or 8.
  std::size_t team = 1;
  std::shared_ptr<const Obstacles> obstacles;  ///< Or null.
  double obstacle_speed = 0.0;                 ///< Of the fastest of them, m/s.
  WindSettings wind;                           ///< Gusts; the mean is each vehicle's own.
  std::string renderer = "beam";               ///< Of ranges, by its name in `RendererKind::table`.
};

/// Where and how a vehicle begins anew.
struct FlightStart {
  Vector3d p_world = Vector3d::Zero();     ///< m
  double yaw = 0.0;                        ///< rad
  SimTime time;                            ///< On the clock of the obstacles.
  std::uint64_t seed = 0;                  ///< Of its gusts and of what its sensor reports.
  Vector3d wind_world = Vector3d::Zero();  ///< Mean, m/s.
  double load_share = 1.0;                 ///< `FlightConditions::load_share`
};

/// Many vehicles, each alone in a map or in a team: stepped together by actions, with collisions
/// and ranges. Results do not depend on threads, on how many there are, or on the instruction set.
class Flights {
 public:
  /// Clearance is known up to here, m.
  static constexpr double kReach = 1.5;
  /// And exactly below, m.
  static constexpr double kExact = 0.5;

  /// How a flight stands.
  struct Status {
    /// Distance of the hull to the map, and to what moves, at the end of the last action, m: exact
    /// below `kExact`, a lower bound beyond, `kReach` at most; minus how deep if it overlaps.
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

  /// Vehicle `i` begins anew: at rest, hovering, with all its rotors. Below a microsecond.
  void place(std::size_t i, const FlightStart& start);
  /// Of its commanded speed that a rotor reaches, 0 to 1, until it is placed again.
  void set_rotor(std::size_t i, std::size_t rotor, double share);
  /// How far the hull of a vehicle at a position would be from obstacles at a time, m, `kReach` at
  /// most.
  [[nodiscard]] double clearance_of_obstacles(const Vector3d& p_world, SimTime time) const;

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
    SimTime time;            ///< Then, on the clock of the obstacles.
    double apart = kReach;   ///< From what moves, m.
    ScanAddress draws;       ///< Of its ranges.
  };
  /// The air around a vehicle.
  struct Gusts {
    Vector3d mean = Vector3d::Zero();
    std::uint64_t seed = 0;
    GustState state;
    std::uint64_t looks = 0;
  };
  void ask(std::size_t i, std::span<const double> action);
  void blow(std::size_t i, double seconds);
  void follow(std::size_t i, Duration passed);
  void look(Watch& watch) const;
  void look_around(std::size_t i);
  [[nodiscard]] std::vector<Body> bodies_around(std::uint32_t vehicle) const;
  void fly_group(std::size_t first,
                 std::span<const double> actions,
                 std::span<const std::uint8_t> moves);

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
  std::vector<Gusts> gusts_;  ///< Empty in steady winds.
  std::optional<Traffic> traffic_;
};

}  // namespace pointflight
