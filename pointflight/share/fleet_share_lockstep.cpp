// Of a process of a shared run: steps that all do together, who joins, who was lost and joins
// again.
#include <fmt/format.h>

#include <algorithm>

#include "pointflight/share/conversion.hpp"
#include "pointflight/share/fleet_share.hpp"

namespace pointflight {
namespace {

using share_msg::Phase;

constexpr std::int64_t kResend = 50 * kMillisecond;  // in lockstep, while nothing comes
constexpr std::int64_t kSaySlow = 2000 * kMillisecond;

}  // namespace

const share_msg::States* FleetShare::step_of(const Peer& peer, SimTime time, bool verdict) {
  for (const share_msg::States& states : peer.steps) {
    const bool is_verdict = (states.flags & share_msg::States::VERDICT) != 0;
    if (to_time(states.time) == time && is_verdict == verdict) return &states;
  }
  return nullptr;
}

/// The process that this one stands still for: it joins, fits, and comes first.
std::uint64_t FleetShare::joiner() const {
  for (const auto& [id, peer] : peers_) {
    if (peer.fits && !peer.lost && peer.intro.phase == Phase::kJoining) return id;
  }
  return 0;
}

/// Lockstep: it has done, or will do, the step at a time. Who has left is gone after its last one.
bool FleetShare::is_needed(Peer& peer, SimTime time) {
  if (!peer.fits || peer.lost || to_time(peer.intro.begins_at) > time) return false;
  if (peer.intro.phase != Phase::kLeft) return peer.intro.phase == Phase::kFlying;
  if (time <= to_time(peer.intro.ends_at)) return true;
  lose(peer, "left", "has left");
  return false;
}

/// A step that is needed and not there will not come.
bool FleetShare::is_hopeless(const Peer& peer, const SharedStep& own) const {
  // a process that waits for this one cannot be so far ahead
  if (peer.newest > own.time + (setup_.ahead + 1) * step_) return true;
  if (own.is_verdict && peer.newest > own.time) return true;  // for it the run goes on
  return peer.gone && peer.intro.phase == Phase::kLeft;
}

/// Until all who fly have said the step that is needed, and nobody wants to join.
void FleetShare::wait_for_steps(const SharedStep& own, SimTime needed) {
  std::int64_t sent = options_.steady();
  const std::int64_t began = sent;
  bool said = false;
  for (;;) {
    receive();
    const std::uint64_t joins = own.is_verdict ? 0 : joiner();
    if (joins != own_.waits_for) {
      own_.waits_for = joins;
      own_.waits_at = to_ns(own.time);
      introduce(Phase::kFlying);
    }
    bool complete = joins == 0;
    for (auto& [id, peer] : peers_) {
      if (!is_needed(peer, needed) || step_of(peer, needed, own.is_verdict) != nullptr) continue;
      if (!is_hopeless(peer, own)) {
        complete = false;
      } else if (!own.is_verdict || peer.intro.phase == Phase::kLeft) {
        const bool left = peer.intro.phase == Phase::kLeft;
        lose(peer, left ? "left" : "lost", left ? "has left" : "has gone on without this process");
      }
    }
    if (complete || !fault_.empty() || options_.interrupted()) return;
    const std::int64_t now = options_.steady();
    if (now - sent > kResend) {
      sent = now;
      for (const Bytes& bytes : last_sent_) transport_.send(ShareChannel::kStates, bytes);
    }
    if (!said && now - began > kSaySlow) {
      said = true;
      if (joins != 0) {
        options_.log(fmt::format("--share {}: at {:.3f} s, standing still until {} has joined",
                                 options_.run,
                                 to_seconds(own.time),
                                 peers_.at(joins).intro.name));
      } else {
        say_slow(needed, own.is_verdict);
      }
    }
    transport_.wait(kMillisecond);
  }
}

void FleetShare::say_slow(SimTime needed, bool verdict) {
  for (const auto& [id, peer] : peers_) {
    if (!peer.flies() || step_of(peer, needed, verdict) != nullptr) continue;
    if (to_time(peer.intro.begins_at) > needed) continue;
    options_.log(fmt::format("--share {}: at {:.3f} s, waiting for {}",
                             options_.run,
                             to_seconds(needed),
                             peer.intro.name));
  }
}

OtherVehicles FleetShare::meet_in_step(const SharedStep& own) {
  send_states(own);
  // with steps ahead the others are taken from so many steps ago, and moved on: the same figures
  // each time, whoever is how fast
  const Duration back = own.is_verdict ? Duration{0} : setup_.ahead * step_;
  // nobody has told who joins what was before
  const SimTime needed = std::max(to_time(own_.begins_at), own.time - back);
  wait_for_steps(own, needed);
  OtherVehicles met;
  met.vehicles.resize(others_.size());
  // what this process said then: all decide by the same words
  own_steps_.push_back(own);
  own_steps_.back().vehicles.clear();
  while (own_steps_.front().time < needed) own_steps_.pop_front();
  met.end_time = own_steps_.front().end_time;
  met.is_landing = own_steps_.front().is_landing;
  for (auto& [id, peer] : peers_) {
    if (!is_needed(peer, needed)) continue;
    const share_msg::States* step = step_of(peer, needed, own.is_verdict);
    if (step == nullptr) continue;
    using States = share_msg::States;
    met.end_time = std::max(met.end_time, to_time(step->end_time));
    met.is_landing = met.is_landing || (step->flags & States::LANDING) != 0;
    met.stops = met.stops || (step->flags & States::STOPS) != 0;
    for (const share_msg::VehicleState& state : step->vehicles) {
      RigidBodyState body = body_of(state);
      if (own.time > needed) body = moved_on(body, to_seconds(own.time - needed));
      others_[state.number].track.add(needed, body_of(state));
      others_[state.number].flags = state.flags;
      mark_present(state.number, peer);
      met.vehicles[state.number] = vehicle_of(state.number, state.flags, body);
      met.vehicles[state.number]->jumped = std::exchange(others_[state.number].jumped, false);
    }
    if (std::exchange(peer.owes_past, false)) send_past(peer);
    look_back_if_asked(peer);
  }
  for (std::size_t v = 0; v < others_.size(); ++v) {
    if (!others_[v].there) place(met, v);
  }
  return met;
}

/// Lockstep: who has lost somebody that has come farther, and hears it again, joins again.
FleetShare::Adjustment FleetShare::rejoin() {
  const auto is_back = [this](const Peer& peer) {
    return peer.fits && peer.lost && peer.intro.phase == Phase::kFlying &&
           options_.steady() - peer.heard < lease_.count() / 2;
  };
  const bool is_behind = std::any_of(peers_.begin(), peers_.end(), [&](const auto& entry) {
    const auto& [id, peer] = entry;
    return is_back(peer) && std::pair(peer.newest, options_.id) > std::pair(now_, id);
  });
  if (!is_behind) return {};
  for (auto& [id, peer] : peers_) {
    if (is_back(peer)) recover(peer);
  }
  introduce(Phase::kJoining);
  while (!may_join_steps() && fault_.empty() && !options_.interrupted()) {
    transport_.wait(kMillisecond);
    receive();
    keep_introducing();
  }
  Adjustment adjustment;
  adjustment.skip = std::max(Duration{0}, to_time(own_.begins_at) - simulation_.time());
  return adjustment;
}

}  // namespace pointflight
