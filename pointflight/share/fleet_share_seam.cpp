// What a process of a shared run is to its simulation: the source of the others' vehicles, and the
// agreement on the end of the run.
#include <algorithm>

#include "pointflight/share/fleet_share.hpp"
#include "pointflight/sim/start_check.hpp"

namespace pointflight {

/// A vehicle that another process flies.
class FleetShare::RemoteVehicle : public VehicleSource {
 public:
  RemoteVehicle(FleetShare& share, std::size_t number) : share_(share), number_(number) {}

  [[nodiscard]] bool flies_elsewhere() const override { return true; }
  std::optional<SourcedState> state_at(SimTime time) override {
    return share_.state_at(number_, time);
  }
  [[nodiscard]] std::optional<PoseTrack> track(SimTime from, SimTime until) const override {
    return share_.track(number_, from, until);
  }
  // those of all, in their order
  std::vector<VehicleEvent> take_events() override { return share_.take_events(); }
  [[nodiscard]] std::optional<SourceReport> report() const override {
    return share_.report(number_);
  }

 private:
  FleetShare& share_;
  std::size_t number_;
};

void FleetShare::take_part(Simulation& simulation) {
  for (std::size_t v = 0; v < others_.size(); ++v) {
    if (std::binary_search(options_.vehicles.begin(), options_.vehicles.end(), v)) continue;
    simulation.follow(v, std::make_shared<RemoteVehicle>(*this, v));
  }
  simulation.agree_by(this);
}

/// What own vehicles are and want at the present time.
SharedStep FleetShare::own_step(bool is_verdict) const {
  const RunOutlook outlook = simulation_.outlook();
  SharedStep step;
  step.time = simulation_.time();
  step.end_time = outlook.end_time;
  step.is_landing = outlook.is_landing;
  step.is_verdict = is_verdict;
  for (const std::size_t v : options_.vehicles) {
    const VehicleOutlook& own = outlook.vehicles[v].value();
    step.vehicles.push_back({static_cast<std::uint32_t>(v),
                             simulation_.status(v).state.body,
                             own.crashed,
                             own.arrived,
                             own.commanded});
  }
  return step;
}

/// At the start of a step: tells where own vehicles are, and learns where the others' are.
void FleetShare::exchange(SimTime time) {
  if (exchanged_at_ == time) return;
  exchanged_at_ = time;
  met_ = meet(own_step(false));
}

std::optional<SourcedState> FleetShare::state_at(std::size_t vehicle, SimTime time) {
  exchange(time);
  const auto& other = met_.vehicles[vehicle];
  if (!other) return std::nullopt;
  return SourcedState{other->body, other->crashed, other->jumped};
}

/// Free processes end by themselves, but for a collision or a landing elsewhere. In lockstep all
/// end in the same step: one that may be the last is told once more, after its collisions.
RunOutlook FleetShare::agree(const RunOutlook& own) {
  const SimTime now = simulation_.time();
  exchange(now);
  RunOutlook all = own;
  if (!decides_together()) {
    all.is_landing = own.is_landing || met_.is_landing;
    all.stops = own.stops || met_.stops;
    return all;
  }
  all.end_time = met_.end_time;
  all.is_landing = met_.is_landing;
  const bool is_last = now >= all.end_time && !all.is_landing;
  if (any_may_stop_ || is_last) {
    SharedStep verdict = own_step(true);
    verdict.stops = own.stops;
    const OtherVehicles others = meet(verdict);
    for (std::size_t v = 0; v < others_.size(); ++v) {
      if (others.vehicles[v]) met_.vehicles[v] = others.vehicles[v];
    }
    all.stops = own.stops || others.stops;
  }
  for (std::size_t v = 0; v < others_.size(); ++v) {
    const auto& other = met_.vehicles[v];
    if (!other) continue;
    all.vehicles[v] = {.has_plan = simulation_.vehicle(v).busy_time() > 0.0,
                       .arrived = other->arrived,
                       .commanded = other->commanded,
                       .crashed = other->crashed,
                       .is_lost = is_lost(simulation_.map(), other->body.p_world)};
  }
  return all;
}

std::vector<VehicleEvent> FleetShare::take_events() {
  return std::exchange(events_, {});
}

SourceReport FleetShare::report(std::size_t vehicle) const {
  const Other& other = others_[vehicle];
  SourceReport report = other.report;
  if (other.seen && !other.there) report.apart += now_ - other.lost_at;
  return report;
}

}  // namespace pointflight
