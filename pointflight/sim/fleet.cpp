#include "pointflight/sim/fleet.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kVehiclesPerChunk = 4;  // that one thread steps

/// A vehicle that is flown elsewhere comes, goes, or is somewhere else.
void place_from_elsewhere(VehicleStatus& status,
                          const std::optional<SourcedState>& said,
                          SimTime now) {
  const bool appears = said && (!status.present || said->jumped);
  if (!said || appears) {
    status.history.clear();
    status.proximity = {};
  }
  if (appears && now > SimTime{}) status.present_since = now;
  status.present = said.has_value();
  if (!said) return;
  status.state.body = said->body;
  status.crashed = said->crashed;
  status.history.record(now, said->body.T_world_body());
}

}  // namespace

Fleet::Fleet(std::vector<std::shared_ptr<const VehicleAgent>> vehicles)
    : vehicles_(std::move(vehicles)), sources_(vehicles_.size()) {
  for (std::size_t i = 0; i < vehicles_.size(); ++i) flying_here_.push_back(i);
}

void Fleet::require(std::size_t number) const {
  if (number < size()) return;
  throw std::out_of_range(
      fmt::format("vehicle {} of a run with {}; they count from 0", number, size()));
}

const VehicleAgent& Fleet::vehicle(std::size_t number) const {
  require(number);
  return *vehicles_[number];
}

void Fleet::follow(std::size_t number, std::shared_ptr<VehicleSource> source) {
  require(number);
  sources_[number] = std::move(source);
  flying_here_.clear();
  for (std::size_t i = 0; i < size(); ++i) {
    if (flies_here(i)) flying_here_.push_back(i);
  }
}

const VehicleSource* Fleet::source(std::size_t number) const {
  require(number);
  return sources_[number].get();
}

bool Fleet::flies_here(std::size_t number) const {
  const VehicleSource* from = source(number);
  return from == nullptr || !from->flies_elsewhere();
}

void Fleet::for_each_here(const Executor& executor,
                          const std::function<void(std::size_t number)>& action) const {
  executor.parallel_for(
      flying_here_.size(), kVehiclesPerChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) action(flying_here_[k]);
      });
}

void Fleet::place(std::span<VehicleStatus> statuses, SimTime now) const {
  for (std::size_t i = 0; i < size(); ++i) {
    if (!sources_[i]) continue;
    const std::optional<SourcedState> said = sources_[i]->state_at(now);
    VehicleStatus& status = statuses[i];
    if (sources_[i]->flies_elsewhere()) {
      place_from_elsewhere(status, said, now);
    } else if (said && said->body.is_finite()) {
      status.summary.distance_flown += (said->body.p_world - status.state.body.p_world).norm();
      status.state.body = said->body;
    }
  }
}

void Fleet::integrate(std::span<VehicleStatus> statuses,
                      SimTime now,
                      double dt,
                      const std::string& location,
                      const Executor& executor) const {
  std::vector<char> fine(size(), 1);
  for_each_here(executor, [&](std::size_t i) {
    if (!sources_[i]) fine[i] = vehicles_[i]->integrate(statuses[i], dt) ? 1 : 0;
  });
  for (const std::size_t i : flying_here_) {
    if (fine[i] != 0) continue;
    throw InputError(fmt::format(
        "{}: the dynamics of {} diverged at {:.3f} s; give a smaller physics_step or softer loops",
        location,
        vehicles_[i]->setup().name,
        to_seconds(now)));
  }
}

PoseTrack Fleet::track(const VehicleStatus& status,
                       std::size_t number,
                       SimTime from,
                       SimTime until) const {
  if (!status.present) return PoseTrack();
  if (const VehicleSource* from_elsewhere = source(number)) {
    if (auto known = from_elsewhere->track(from, until)) return *std::move(known);
  }
  return status.history.track(from, until);
}

std::vector<VehicleEvent> Fleet::take_events() const {
  std::vector<VehicleEvent> events;
  for (const auto& source : sources_) {
    if (!source) continue;
    for (VehicleEvent& event : source->take_events()) events.push_back(std::move(event));
  }
  return events;
}

}  // namespace pointflight
