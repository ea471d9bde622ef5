#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/sim/vehicle_agent.hpp"
#include "pointflight/sim/vehicle_source.hpp"

namespace pointflight {

/// The vehicles of a run and where each one's state comes from: its own dynamics, or a
/// `VehicleSource`. What changes of them is a `VehicleStatus` each, by number, which functions
/// take. Copies of a fleet share vehicles and sources.
class Fleet {
 public:
  /// Nobody.
  Fleet() = default;
  /// All by their own dynamics.
  explicit Fleet(std::vector<std::shared_ptr<const VehicleAgent>> vehicles);

  /// Copies included.
  [[nodiscard]] std::size_t size() const { return vehicles_.size(); }
  /// By number, from 0. Throws std::out_of_range.
  [[nodiscard]] const VehicleAgent& vehicle(std::size_t number) const;

  /// From now on a vehicle's state comes from elsewhere; null: from its own dynamics. Throws
  /// std::out_of_range.
  void follow(std::size_t number, std::shared_ptr<VehicleSource> source);
  /// Null: its own dynamics. Throws std::out_of_range.
  [[nodiscard]] const VehicleSource* source(std::size_t number) const;
  /// True if its sensors and controllers are here.
  [[nodiscard]] bool flies_here(std::size_t number) const;
  /// Numbers of those, ascending.
  [[nodiscard]] const std::vector<std::size_t>& flying_here() const { return flying_here_; }
  /// An action for each of them, by all threads.
  void for_each_here(const Executor& executor,
                     const std::function<void(std::size_t number)>& action) const;

  /// At the start of a step: vehicles with a source are where it says.
  void place(std::span<VehicleStatus> statuses, SimTime now) const;
  /// The end of a step: own dynamics go on by `dt` seconds. Throws InputError if they diverge;
  /// `location` is where users can mend that.
  void integrate(std::span<VehicleStatus> statuses,
                 SimTime now,
                 double dt,
                 const std::string& location,
                 const Executor& executor) const;

  /// Where a vehicle was in [from, until]; at the origin if it is not there.
  [[nodiscard]] PoseTrack track(const VehicleStatus& status,
                                std::size_t number,
                                SimTime from,
                                SimTime until) const;
  /// What sources have to tell since they were last asked.
  [[nodiscard]] std::vector<VehicleEvent> take_events() const;

 private:
  void require(std::size_t number) const;

  std::vector<std::shared_ptr<const VehicleAgent>> vehicles_;
  std::vector<std::shared_ptr<VehicleSource>> sources_;
  std::vector<std::size_t> flying_here_;
};

}  // namespace pointflight
