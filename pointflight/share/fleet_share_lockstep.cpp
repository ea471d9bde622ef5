// Of a process of a shared run: steps that all do together, who joins, who was lost and joins
// again.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

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

/// Says, however long the step takes, that this process runs and what it has told.
void FleetShare::repeat_beat(const SharedStep& own, bool waits) {
  share_msg::Beat beat;
  beat.head.kind = share_msg::Kind::kBeat;
  beat.head.process = options_.id;
  beat.time = to_ns(own.time);
  beat.verdict = own.is_verdict;
  beat.waits = waits;
  transport_.repeat(bytes_of(beat));
}

void FleetShare::take_beat(const ShareArrival& arrival) {
  const auto beat = decode<Wire::kCdr, share_msg::Beat>(arrival.bytes);
  if (!beat || !share_msg::is_time(beat->time)) {
    note_foreign(arrival.writer, "a beat that makes no sense");
    return;
  }
  Peer* peer = peer_of(beat->head.process, arrival.writer);
  if (peer == nullptr) return;
  peer->told = {beat->time, beat->verdict};
  peer->waits = beat->waits;
}

/// Who runs says so several times in a lease, whatever it does.
bool FleetShare::is_silent(const Peer& peer, std::int64_t since) const {
  return options_.steady() - std::max(peer.spoke, since) > patience_;
}

/// It has told what is needed, and that does not come: packets that were changed on their way have
/// made DDS take it for old, or it does not know any more that this process listens.
bool FleetShare::tells_in_vain(Peer& peer, SimTime needed, bool verdict) {
  if (peer.told < std::pair(to_ns(needed), verdict)) {
    peer.told_at = 0;
    return false;
  }
  if (peer.told_at == 0) peer.told_at = options_.steady();
  return options_.steady() - peer.told_at > patience_;
}

/// Of one that runs, and whose words do not come.
void FleetShare::give_up(Peer& peer, const std::string& words) {
  constexpr std::int64_t kPause = 10;  // patiences
  peer.back_from = options_.steady() + kPause * patience_;
  rejoins_from_ = std::max(rejoins_from_, peer.back_from);
  lose(peer, "lost", words);
}

/// Of one whose step is needed and not there: true if it will not come. It is lost then.
bool FleetShare::lose_hopeless(Peer& peer,
                               const SharedStep& own,
                               SimTime needed,
                               std::int64_t since) {
  const bool left = peer.intro.phase == Phase::kLeft;
  if (is_hopeless(peer, own)) {
    // a verdict: for it the run goes on
    if (own.is_verdict && !left) return true;
    lose(peer, left ? "left" : "lost", left ? "has left" : "has gone on without this process");
    return true;
  }
  if (is_silent(peer, since)) {
    give_up(peer,
            fmt::format("has said nothing for {:.1f} s", 1e-9 * static_cast<double>(patience_)));
    return true;
  }
  if (!tells_in_vain(peer, needed, own.is_verdict)) return false;
  give_up(peer, "is heard, but its steps do not come");
  return true;
}

/// While this process waits: all others wait as well, and have told nothing for long. One of them
/// does not get what it waits for; in a run that goes on somebody works.
bool FleetShare::is_stuck(Standstill& standstill) const {
  const std::int64_t now = options_.steady();
  std::vector<std::pair<std::int64_t, bool>> told;
  bool any_works = false;
  for (const auto& [id, peer] : peers_) {
    if (!peer.flies()) continue;
    told.push_back(peer.told);
    any_works = any_works || !peer.waits;
  }
  if (any_works || told != standstill.told) {
    standstill = {told, now};
    return false;
  }
  return now - standstill.since > patience_ + options_.settle.count();
}

void FleetShare::lose_all_waited_for(const SharedStep& own, SimTime needed, std::uint64_t joins) {
  for (auto& [id, peer] : peers_) {
    const bool is_awaited = id == joins || (is_needed(peer, needed) &&
                                            step_of(peer, needed, own.is_verdict) == nullptr);
    if (is_awaited) give_up(peer, "waits as this process does, and nothing comes of it");
  }
}

/// Until all who fly have said the step that is needed, and nobody wants to join.
void FleetShare::wait_for_steps(const SharedStep& own, SimTime needed) {
  std::int64_t sent = options_.steady();
  const std::int64_t began = sent;
  std::int64_t looked = began;
  std::int64_t since = began;
  bool said = false;
  Standstill standstill{{}, began};
  for (auto& [id, peer] : peers_) peer.told_at = 0;
  for (;;) {
    receive();
    const std::int64_t now = options_.steady();
    // a process that was stopped itself has heard nobody
    if (now - std::exchange(looked, now) > patience_ / 4) since = standstill.since = now;
    const std::uint64_t joins = own.is_verdict ? 0 : joiner();
    if (joins != own_.waits_for) {
      own_.waits_for = joins;
      own_.waits_at = to_ns(own.time);
      introduce(Phase::kFlying);
    }
    bool complete = joins == 0;
    for (auto& [id, peer] : peers_) {
      if (!is_needed(peer, needed) || step_of(peer, needed, own.is_verdict) != nullptr) continue;
      if (!lose_hopeless(peer, own, needed, since)) complete = false;
    }
    if (complete || !fault_.empty() || options_.interrupted()) {
      repeat_beat(own, false);
      return;
    }
    if (is_stuck(standstill)) lose_all_waited_for(own, needed, joins);
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

/// Somebody was lost, has come farther, and is heard again.
bool FleetShare::is_left_out() const {
  return std::any_of(peers_.begin(), peers_.end(), [&](const auto& entry) {
    const auto& [id, peer] = entry;
    return is_back(peer) && std::pair(peer.newest, options_.id) > std::pair(now_, id);
  });
}

bool FleetShare::is_back(const Peer& peer) const {
  return peer.fits && peer.lost && peer.intro.phase == Phase::kFlying &&
         options_.steady() - peer.heard < lease_.count() / 2;
}

/// Stands still until the others do so for this process; false if they go on without it.
bool FleetShare::join_again() {
  const std::int64_t began = options_.steady();
  Standstill standstill{{}, began};
  std::map<std::uint64_t, std::int64_t> told;
  for (const auto& [id, peer] : peers_) told[id] = peer.told.first;
  introduce(Phase::kJoining);
  while (!may_join_steps() && fault_.empty() && !options_.interrupted()) {
    transport_.wait(kMillisecond);
    receive();
    keep_introducing();
    if (is_stuck(standstill)) return false;
    if (options_.steady() - began < patience_) continue;
    for (const auto& [id, peer] : peers_) {
      const bool goes_on = peer.told.first > told[id] + 2 * step_.count();
      if (peer.flies() && (goes_on || is_silent(peer, began))) return false;
    }
  }
  return true;
}

/// Lockstep: who has lost somebody that has come farther, and hears it again, joins again.
FleetShare::Adjustment FleetShare::rejoin() {
  if (options_.steady() < rejoins_from_ || !is_left_out()) return {};
  for (auto& [id, peer] : peers_) {
    if (is_back(peer)) recover(peer);
  }
  if (!join_again()) {
    for (auto& [id, peer] : peers_) {
      if (peer.flies()) give_up(peer, "does not take this process back");
    }
    return {};
  }
  Adjustment adjustment;
  adjustment.skip = std::max(Duration{0}, to_time(own_.begins_at) - simulation_.time());
  return adjustment;
}

}  // namespace pointflight
