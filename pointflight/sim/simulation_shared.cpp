// A run that other processes take part in, and time that is jumped over.
#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "pointflight/sim/simulation_setup.hpp"

namespace pointflight {

void Simulation::share(const std::vector<std::size_t>& own, FleetExchange& others) {
  for (const std::size_t number : own) require_vehicle(number);
  own_ = own;
  std::sort(own_.begin(), own_.end());
  own_.erase(std::unique(own_.begin(), own_.end()), own_.end());
  if (own_.empty()) throw std::invalid_argument("a process that flies no vehicle");
  others_ = &others;
  for (std::size_t i = 0; i < vehicle_count(); ++i) state_.vehicles[i].present = is_own(i);
  met_.vehicles.assign(vehicle_count(), std::nullopt);
}

bool Simulation::is_own(std::size_t vehicle) const {
  require_vehicle(vehicle);
  return others_ == nullptr || std::binary_search(own_.begin(), own_.end(), vehicle);
}

/// What own vehicles are and want at the present time.
SharedStep Simulation::shared_step(bool is_verdict) const {
  SharedStep step;
  step.time = state_.time;
  step.end_time = own_end_time();
  step.is_landing = setup_->scenario.duration <= 0.0 && lands();
  step.is_verdict = is_verdict;
  for (const std::size_t i : own_) {
    const VehicleStatus& s = status(i);
    step.vehicles.push_back(
        {static_cast<std::uint32_t>(i), s.state.body, s.crashed, has_arrived(i), s.commanded});
  }
  return step;
}

/// Where the others' vehicles are at the start of a step.
void Simulation::meet_others() {
  const SharedStep own = shared_step(false);
  met_ = others_->meet(own);
  if (!others_->decides_together()) met_.is_landing = met_.is_landing || own.is_landing;
  met_.vehicles.resize(vehicle_count());
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
    if (is_own(i)) continue;
    VehicleStatus& s = state_.vehicles[i];
    const auto& other = met_.vehicles[i];
    if (!other || !s.present || other->jumped) {
      s.history.clear();
      s.proximity = {};
    }
    const bool comes = other && (!s.present || other->jumped);
    if (comes && state_.step_number > 0) s.present_since = state_.time;
    s.present = other.has_value();
    if (!other) continue;
    s.state.body = other->body;
    s.crashed = other->crashed;
  }
}

/// After collisions were looked for: another process' vehicle is where it was for the next step.
void Simulation::place_other(std::size_t number) {
  VehicleStatus& s = state_.vehicles[number];
  if (!s.present) return;
  s.proximity.T_world_body = s.state.body.T_world_body();
  s.proximity.started = true;
  s.history.record(state_.time, s.proximity.T_world_body);
}

/// Whether a collision ends the run, here or elsewhere. In a step that may be the last one all
/// processes say what they are after its collisions.
bool Simulation::agree(bool stops, bool last) {
  if (others_ == nullptr) return stops;
  if (!others_->decides_together()) return stops || met_.stops;
  bool any_stops = false;
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
    any_stops = any_stops || vehicle(i).setup().on_collision == CollisionReaction::kStop;
  }
  if (!any_stops && !last) return stops;
  SharedStep verdict = shared_step(true);
  verdict.stops = stops;
  const OtherVehicles others = others_->meet(verdict);
  for (std::size_t i = 0; i < met_.vehicles.size() && i < others.vehicles.size(); ++i) {
    if (others.vehicles[i]) met_.vehicles[i] = others.vehicles[i];
    if (others.vehicles[i]) state_.vehicles[i].crashed = others.vehicles[i]->crashed;
  }
  return stops || others.stops;
}

/// How the run ends depends on it.
bool Simulation::is_judged(std::size_t number) const {
  if (is_own(number)) return true;
  return others_->decides_together() && met_.vehicles[number].has_value();
}

bool Simulation::is_commanded(std::size_t number) const {
  return is_own(number) ? status(number).commanded : met_.vehicles[number]->commanded;
}

void Simulation::move_schedules_to(SimTime time) {
  if (time < state_.time || time.time_since_epoch() % setup_->step != Duration{0}) {
    throw std::invalid_argument(fmt::format("from {} s to {} s: not a whole number of steps ahead",
                                            to_seconds(state_.time),
                                            to_seconds(time)));
  }
  state_.time = time;
  state_.step_number = static_cast<std::uint64_t>(time.time_since_epoch() / setup_->step);
  state_.next_obstacle_sample = setup_->obstacle_schedule.first_from(time);
  state_.next_status = Schedule(kStatusRate).first_from(time);
  for (const std::size_t i : own_) vehicle(i).move_schedules_to(state_.vehicles[i], time);
}

void Simulation::skip_to(SimTime time) {
  if (time == state_.time) return;
  const Duration by = time - state_.time;
  move_schedules_to(time);
  state_.skipped += by;
  state_.busy_until += by;
  for (VehicleStatus& s : state_.vehicles) {  // nobody has flown through what lies between
    s.history.clear();
    s.proximity = {};
    s.present_since = time;
  }
  for (const std::size_t i : own_) {
    state_.vehicles[i].skipped += by;
    state_.vehicles[i].autopilot.since += by;
  }
}

void Simulation::resume_at(SimTime time,
                           Duration skipped,
                           const std::map<std::size_t, VehicleState>& states) {
  move_schedules_to(time);
  state_.skipped = skipped;
  state_.earlier = time.time_since_epoch() - skipped;
  for (const std::size_t i : own_) state_.vehicles[i].skipped = skipped;
  for (const auto& [number, state] : states) {
    require_vehicle(number);
    vehicle(number).resume(state_.vehicles[number], state, time);
  }
}

}  // namespace pointflight
