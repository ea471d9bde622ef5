#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/sim/ending.hpp"
#include "pointflight/sim/fleet.hpp"
#include "pointflight/sim/samples.hpp"
#include "pointflight/sim/scenario.hpp"
#include "pointflight/sim/sensor_costs.hpp"

namespace pointflight {

/// Everything of a run that changes: a value. What it holds by pointer (trajectories that are
/// flown) is immutable.
struct SimulationState {
  SimTime time;                           ///< Start of the next step.
  std::uint64_t step_number = 0;          ///< Steps that were done.
  std::int64_t next_obstacle_sample = 0;  ///< Index in the schedule of output.obstacle_rate.
  std::int64_t next_status = 0;           ///< Index in the schedule of `kStatusRate`.
  Ending ending;                          ///< No step is done once it is over.
  SimTime busy_until;   ///< That commands from the program last and what is waited after them.
  Duration skipped{0};  ///< Time that was jumped over (`Simulation::skip_to`).
  Duration earlier{0};  ///< Time that an earlier process simulated (`Simulation::resume_at`).
  std::vector<VehicleStatus> vehicles;  ///< By number.
};

/// The deterministic loop: sense, control, integrate, and scans in arrears. A function of scenario,
/// map and commands; threads, wall clock and sinks change nothing.
///
/// A run can be saved and restored (`state`, `restore`), and branched: a copy of a Simulation goes
/// its own way and shares what does not change (map, renderers, models) with the original.
class Simulation {
 public:
  /// Clearance is known up to here, m.
  static constexpr double kClearanceReach = 10.0;
  /// A run without a duration ends so long after all is done and the last command came, s.
  static constexpr double kIdleTime = 10.0;
  /// Of `StatusSample`s, Hz.
  static constexpr double kStatusRate = 10.0;

  /// Throws InputError if the scenario cannot be flown (unknown models, start inside the map,
  /// far outside of it or in each other, obstacles without room), std::invalid_argument without a
  /// map. The executor must outlive it.
  Simulation(const Scenario& scenario,
             std::shared_ptr<const SurfelMap> map,
             const Executor& executor);

  /// One physics step; samples that fall due go to `sink`. False when the run has ended.
  bool step(SampleSink& sink);

  /// Steps until the present time is `time` or later. False when the run has ended.
  bool advance_to(SimTime time, SampleSink& sink);

  /// Tells a vehicle what to do from now on. Returns why it does not, if so: such commands are
  /// counted, and change nothing. A run without a duration goes on while commands come, until
  /// `kIdleTime` after the last (and its trajectory). Throws std::out_of_range without such a
  /// vehicle, as all functions do that take its number.
  std::optional<std::string> command(std::size_t vehicle, const Command& command);

  /// From now on the vehicle's state comes from elsewhere; null: from its own dynamics again. Not
  /// part of `state`. One that is flown elsewhere as a whole (`VehicleSource::flies_elsewhere`) is
  /// seen in scans and can be hit, and takes no commands.
  void follow(std::size_t vehicle, std::shared_ptr<VehicleSource> source);
  /// From now on the run ends when this agreement says so, which must outlive it; null: when the
  /// vehicles that fly here do.
  void agree_by(EndingAgreement* agreement);
  /// True with an agreement.
  [[nodiscard]] bool ends_by_agreement() const { return agreement_ != nullptr; }
  /// True if the vehicle's sensors and controllers are here.
  [[nodiscard]] bool flies_here(std::size_t vehicle) const { return fleet_.flies_here(vehicle); }
  /// Numbers of those, ascending.
  [[nodiscard]] const std::vector<std::size_t>& flying_here() const { return fleet_.flying_here(); }
  /// What the sources of the others say of how well they know them.
  [[nodiscard]] std::vector<SourceReport> source_reports() const;

  /// Jumps ahead in time without moving the vehicles: their commands last as long as they would
  /// have, and their sensors start with the next measurement. Obstacles are where they are at that
  /// time. Throws std::invalid_argument if `time` is not a whole number of steps, is earlier, or
  /// over `kLongestRun` ahead.
  void skip_to(SimTime time);

  /// Before the first step: as if the run had come to `time`, of which `skipped` was jumped over,
  /// with these states of vehicles (by number), and with what the scenario told them until then
  /// under way. Rotors that stand are those of a wreck, unless the scenario told the vehicle to
  /// land, to disarm, or to start on the ground and it is there. Controllers, batteries and
  /// what sensors remember are as at the start. Throws as `skip_to`.
  void resume_at(SimTime time, Duration skipped, const std::map<std::size_t, VehicleState>& states);

  /// Ends the run early.
  void interrupt();
  /// Ends the run as completed: a goal that only the calling program knows is reached.
  void complete();

  /// All that changes, to be copied and kept for `restore`.
  [[nodiscard]] const SimulationState& state() const { return state_; }
  /// Goes on from a state of this simulation or a copy of it: the same bytes as the first time.
  /// Throws std::invalid_argument if it is of another fleet.
  void restore(const SimulationState& state);

  /// Of the states that `status` has: the start of the next step.
  [[nodiscard]] SimTime time() const { return state_.time; }
  /// How much of `time` was simulated: without what was skipped, and before `resume_at`.
  [[nodiscard]] Duration simulated() const {
    return state_.time.time_since_epoch() - state_.skipped - state_.earlier;
  }
  /// When the run ends by itself: the scenario's duration, or else the end of missions and
  /// commands, which moves as a program gives more; then a landing under way is waited for.
  [[nodiscard]] SimTime end_time() const;
  /// `RunEnd::kRunning` until a step returns false or the run was ended.
  [[nodiscard]] RunEnd end() const { return state_.ending.why; }
  /// What matters for the end of the run of the vehicles that fly here, at `time`; no collision.
  [[nodiscard]] RunOutlook outlook() const;
  /// As it was given; copies of vehicles are not written out.
  [[nodiscard]] const Scenario& scenario() const;
  /// The one that is flown in.
  [[nodiscard]] const SurfelMap& map() const;
  /// The same, to be kept beyond the simulation.
  [[nodiscard]] std::shared_ptr<const SurfelMap> shared_map() const;

  /// Copies included.
  [[nodiscard]] std::size_t vehicle_count() const { return state_.vehicles.size(); }
  /// What does not change of a vehicle: hull, LiDARs, settings. Throws std::out_of_range.
  [[nodiscard]] const VehicleAgent& vehicle(std::size_t number) const;
  /// What changes of a vehicle, at `time`. Throws std::out_of_range.
  [[nodiscard]] const VehicleStatus& status(std::size_t number) const;
  /// The same as a sample: what outsiders are told of it.
  [[nodiscard]] StatusSample status_sample(std::size_t number) const;
  /// What happened to a vehicle so far. Throws std::out_of_range.
  [[nodiscard]] const VehicleSummary& summary(std::size_t number) const {
    return status(number).summary;
  }

  /// What its sensors have cost so far, those of its copies included.
  [[nodiscard]] const SensorCosts& costs() const { return *costs_; }

  /// How many there are at any time: their labels follow `kFirstObstacle`.
  [[nodiscard]] std::size_t obstacle_count() const;
  /// Obstacles between two instants, at most `kLongestRun` ahead.
  [[nodiscard]] std::vector<Body> obstacles(SimTime from, SimTime until) const;
  /// All that moves, obstacles and vehicles, where it is at `time`.
  [[nodiscard]] std::vector<Body> bodies() const;

 private:
  struct Setup;

  void check_start(std::size_t number) const;
  [[nodiscard]] bool react(std::vector<StepSamples>& samples);
  [[nodiscard]] Ending judge(bool stops);
  void act(SimTime until, std::vector<StepSamples>& samples);
  void sample_obstacles(SimTime until, SampleSink& sink);
  void sample_status(SampleSink& sink);
  void advance();
  void move_schedules_to(SimTime time);
  [[nodiscard]] bool has_arrived(std::size_t number) const;
  [[nodiscard]] bool is_landing() const;

  std::shared_ptr<const Setup> setup_;
  const Executor* executor_;
  Fleet fleet_;
  std::shared_ptr<SensorCosts> costs_;
  EndingAgreement* agreement_ = nullptr;
  SimTime agreed_end_;  ///< With an agreement.
  SimulationState state_;
};

}  // namespace pointflight
