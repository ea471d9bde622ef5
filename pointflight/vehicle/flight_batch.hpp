#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/multirotor.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

/// What the vehicles of a batch are told, over and over: setpoints of vehicle/command.hpp.
enum class FlightLevel {
  kVelocity,      ///< m/s, world; turns at a yaw rate from its present heading on.
  kAcceleration,  ///< Without gravity, m/s^2, world; turns in the same way.
  kBodyRates,     ///< rad/s, body, and thrust, N.
  kRotorSpeeds,   ///< rad/s
};

/// How often what is done in a batch.
struct FlightTiming {
  double physics_step = 0.005;  ///< s
  int steps_per_control = 1;    ///< Rotor commands are held over so many physics steps.
  /// Runge-Kutta steps in a physics step; 2 as `Multirotor::step` does it.
  int parts = 1;
};

/// Many vehicles of one kind under the geometric controller, each in a lane of a vector. A
/// vehicle's bits are those of `Autopilot` and `Multirotor` with the same steps, whatever the
/// instruction set, the number of vehicles and the threads: different groups may be flown by
/// different threads.
class FlightBatch {
 public:
  /// Vehicles [k * kGroup, (k + 1) * kGroup) are flown together.
  static constexpr std::size_t kGroup = 8;
  /// A height of the ground that nothing is felt of, m.
  static constexpr double kFarBelow = -1e6;

  /// `count` vehicles that hover at the origin. Throws InputError as `Multirotor` does.
  FlightBatch(const VehicleSettings& settings, std::size_t count, const FlightTiming& timing);
  ~FlightBatch();
  /// Leaves `other` to be assigned to or destroyed.
  FlightBatch(FlightBatch&& other) noexcept;
  /// The same.
  FlightBatch& operator=(FlightBatch&& other) noexcept;

  /// How many there are.
  [[nodiscard]] std::size_t size() const;
  /// As given.
  [[nodiscard]] const VehicleSettings& settings() const;
  /// s
  [[nodiscard]] double control_period() const;

  /// A vehicle begins anew in calm air far above the ground, as its file has it, with a state of
  /// the body, rotors at hover speed.
  void place(std::size_t vehicle, const RigidBodyState& body);
  /// The air of a vehicle from now on.
  void set_air(std::size_t vehicle, const Vector3d& wind_world, double ground_z);
  /// As `FlightConditions::load_share`, from now on.
  void set_load(std::size_t vehicle, double share);
  /// Of its commanded speed that a rotor reaches from now on, 0 to 1.
  void set_rotor(std::size_t vehicle, std::size_t rotor, double share);
  /// What it is told from now on, of levels but rotor speeds; `turn`: yaw rate (rad/s), or thrust
  /// (N) beside body rates.
  void ask(std::size_t vehicle, const Vector3d& asked, double turn);
  /// Speeds of all its rotors, rad/s.
  void ask_rotors(std::size_t vehicle, const double* speeds);

  /// Control periods of the vehicles of one group, by what they were asked for.
  void fly(std::size_t group, FlightLevel level, int periods);
  /// Of all groups.
  void fly(FlightLevel level, int periods);

  /// Numbers that a vehicle is.
  [[nodiscard]] std::size_t column_size() const;
  /// Copies all of a vehicle, `column_size()` numbers, to be given to `restore`.
  void save(std::size_t vehicle, std::span<double> numbers) const;
  /// The vehicle is as it was when it was saved; of this batch or one like it.
  void restore(std::size_t vehicle, std::span<const double> numbers);

  /// m, world.
  [[nodiscard]] Vector3d position(std::size_t vehicle) const;
  /// Of the body.
  [[nodiscard]] RigidBodyState body(std::size_t vehicle) const;
  /// Of the body and rotors.
  [[nodiscard]] VehicleState state(std::size_t vehicle) const;
  /// Heading that it is asked for, rad.
  [[nodiscard]] double yaw(std::size_t vehicle) const;

 private:
  struct Table;
  std::unique_ptr<Table> table_;
};

}  // namespace pointflight
