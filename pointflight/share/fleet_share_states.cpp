// Of a process of a shared run: whose states are heard, and where others' vehicles are by them.
#include <fmt/format.h>

#include <algorithm>

#include "pointflight/share/conversion.hpp"
#include "pointflight/share/fleet_share.hpp"

namespace pointflight {
namespace {

using share_msg::Kind;
using share_msg::Phase;

constexpr std::size_t kResentMost = 8;  // messages
constexpr double kJump = 0.1;           // s moved on, after which a vehicle may be elsewhere
constexpr Duration kPastKept = std::chrono::seconds(120);
constexpr double kPastRate = 2000.0;  // states per second, of all vehicles

}  // namespace

void FleetShare::note(std::size_t vehicle, const char* kind, const std::string& words) {
  VehicleEvent event;
  event.vehicle = static_cast<std::uint32_t>(vehicle);
  event.time = now_;
  event.kind = kind;
  event.words = words;
  if (!others_[vehicle].track.empty()) event.vehicle_world = others_[vehicle].track.last().p_world;
  events_.push_back(std::move(event));
}

void FleetShare::lose_writer(std::uint64_t writer) {
  for (auto& [id, peer] : peers_) {
    if (peer.writer != writer) continue;
    peer.gone = true;
    if (!peer.fits || peer.lost) continue;
    // lockstep: of one that has left, steps that came are still used
    if (peer.intro.phase == Phase::kLeft) continue;
    lose(peer, "lost", "is not heard any more: its lease has run out");
  }
}

void FleetShare::lose(Peer& peer, const char* kind, const std::string& words) {
  peer.lost = true;
  peer.newest = SimTime{};
  peer.past.reset();
  peer.lost_at = now_;
  peer.steps.clear();
  peer.clock.clear();
  const bool left = peer.intro.phase == Phase::kLeft;
  stopped_ = stopped_ || (left && peer.intro.stops);
  const char* then = left                              ? ""
                     : setup_.on_loss == OnLoss::kHold ? "; its body stays"
                                                       : "; its body vanishes";
  for (const std::uint32_t v : peer.intro.vehicles) {
    Other& other = others_[v];
    if (!other.seen || other.process != peer.intro.head.process) continue;
    if (!other.there && !left) continue;
    if (!other.there) other.report.apart += std::max(Duration{0}, now_ - other.lost_at);
    other.lost_at = other.track.empty() ? now_ : std::min(now_, other.track.newest());
    other.there = false;
    if (left) other.seen = false;  // its body goes with it
    if (!left) ++other.report.losses;
    note(v, kind, fmt::format("{} {}{}", peer.intro.name, words, then));
  }
  recheck_other_peers();
}

void FleetShare::watch_silence() {
  const std::int64_t now = options_.steady();
  for (auto& [id, peer] : peers_) {
    if (!peer.flies() || now - peer.heard < lease_.count()) continue;
    lose(peer, "lost", fmt::format("has been silent for {:.1f} s", setup_.lease));
  }
}

void FleetShare::recover(Peer& peer) {
  peer.lost = false;
  peer.steps.clear();
  peer.owes_past = true;
}

/// Its states are there (again).
void FleetShare::mark_present(std::uint32_t number, Peer& peer) {
  Other& other = others_[number];
  const bool same = other.process == peer.intro.head.process;
  other.process = peer.intro.head.process;
  other.report.flown_by = peer.intro.name;
  if (std::exchange(other.there, true)) return;
  other.jumped = true;
  const bool was_seen = std::exchange(other.seen, true);
  if (!was_seen) return;
  const Duration apart = std::max(Duration{0}, now_ - other.lost_at);
  other.report.apart += apart;
  other.back_at = now_;
  if (same) {
    other.asks_past = true;
  } else {
    ++other.report.unknown_contacts;
  }
  note(number,
       "back",
       fmt::format("{} is heard again after {:.1f} s{}",
                   peer.intro.name,
                   to_seconds(apart),
                   same ? "" : "; another process than before"));
}

void FleetShare::take_states(const ShareArrival& arrival) {
  auto states = decode<Wire::kCdr, share_msg::States>(arrival.bytes);
  if (!states || !share_msg::is_time(states->time) || !share_msg::is_time(states->end_time)) {
    note_foreign(arrival.writer, "states that make no sense");
    return;
  }
  Peer* peer = peer_of(states->head.process, arrival.writer);
  if (peer == nullptr || !peer->fits || peer->intro.phase == Phase::kJoining) return;
  if (peer->intro.phase == Phase::kLeft && !decides_together()) return;
  for (const share_msg::VehicleState& state : states->vehicles) {
    const auto& its = peer->intro.vehicles;
    const bool is_its = std::find(its.begin(), its.end(), state.number) != its.end();
    if (is_its && is_plausible(body_of(state))) continue;
    note_foreign(arrival.writer, "states that none of its vehicles can have");
    return;
  }
  peer->heard = arrival.at;
  peer->back_from = 0;
  if (peer->received > 0 && states->counter > peer->counter) {
    peer->missing += states->counter - peer->counter - 1;
  }
  ++peer->received;
  peer->counter = std::max(peer->counter, states->counter);
  peer->newest = std::max(peer->newest, to_time(states->time));
  if (decides_together()) {
    if (peer->lost && phase_ != Phase::kJoining) return;
    if (peer->lost) recover(*peer);
    const auto said = std::pair(states->time, states->flags & share_msg::States::VERDICT);
    for (const share_msg::States& known : peer->steps) {
      if (std::pair(known.time, known.flags & share_msg::States::VERDICT) == said) return;
    }
    const std::size_t kept = 2 * (static_cast<std::size_t>(setup_.ahead) + 8);
    if (peer->steps.size() >= kept) peer->steps.pop_front();
    peer->steps.push_back(std::move(*states));
    return;
  }
  if (peer->lost) {
    check(*peer);  // somebody else may fly its vehicles by now
    if (!peer->fits) return;
    recover(*peer);
  }
  for (const share_msg::VehicleState& state : states->vehicles) {
    Other& other = others_[state.number];
    if (other.process != peer->intro.head.process || !other.there) other.track.clear();
    RigidBodyState body = body_of(state);
    body.q_world_body.normalize();
    other.track.add(to_time(states->time), body);
    if (other.track.newest() == to_time(states->time)) other.flags = state.flags;
    mark_present(state.number, *peer);
  }
  if (std::exchange(peer->owes_past, false)) send_past(*peer);
  look_back_if_asked(*peer);
}

void FleetShare::send_states(const SharedStep& own) {
  share_msg::States states;
  states.head.kind = Kind::kStates;
  states.head.process = options_.id;
  states.counter = counter_++;
  states.time = to_ns(own.time);
  states.end_time = to_ns(own.end_time);
  states.flags = (own.is_landing ? share_msg::States::LANDING : 0u) |
                 (own.stops ? share_msg::States::STOPS : 0u) |
                 (own.is_verdict ? share_msg::States::VERDICT : 0u);
  for (const SharedVehicle& vehicle : own.vehicles) states.vehicles.push_back(state_of(vehicle));
  last_sent_.push_back(bytes_of(states));
  while (last_sent_.size() > (decides_together() ? kResentMost : 1)) last_sent_.pop_front();
  transport_.send(ShareChannel::kStates, last_sent_.back());
  if (decides_together()) repeat_beat(own, true);
}

/// For those who were apart: where own vehicles were; of many vehicles at fewer instants.
void FleetShare::remember(const SharedStep& own) {
  const double states = static_cast<double>(own.vehicles.size());
  const Duration apart = from_seconds(states / kPastRate) - step_;
  if (!past_.empty() && own.time < past_.back().time + apart) return;
  for (const SharedVehicle& vehicle : own.vehicles) past_.push_back({own.time, state_of(vehicle)});
  while (past_.front().time < own.time - kPastKept) past_.pop_front();
}

OtherVehicles FleetShare::meet(const SharedStep& own) {
  if (phase_ != Phase::kFlying) begin();
  now_ = own.time;
  if (!own.is_verdict && schedule_.at(next_sent_) <= own.time) {
    next_sent_ = schedule_.first_from(own.time + Duration{1});
    remember(own);
    if (!decides_together()) send_states(own);
  }
  OtherVehicles others = decides_together() ? meet_in_step(own) : meet_free();
  others.stops = others.stops || stopped_;
  give_up_past();
  return others;
}

OtherVehicles FleetShare::meet_free() {
  receive();
  watch_silence();
  OtherVehicles met;
  met.vehicles.resize(others_.size());
  for (std::size_t v = 0; v < others_.size(); ++v) place(met, v);
  return met;
}

/// Where another process' vehicle is now, by what is known of it.
void FleetShare::place(OtherVehicles& met, std::size_t number) {
  Other& other = others_[number];
  if (!other.seen || other.track.empty()) return;
  const auto v = static_cast<std::uint32_t>(number);
  if (other.there) {
    const auto body = other.track.at(now_, lease_);
    if (!body) return;
    met.vehicles[number] = vehicle_of(v, other.flags, *body);
    const double moved = to_seconds(std::min(lease_, now_ - other.track.newest()));
    const double before = std::exchange(other.moved, moved);
    // after a long silence it is elsewhere: it did not fly there in one step
    met.vehicles[number]->jumped =
        std::exchange(other.jumped, false) || (before > kJump && moved < before);
    if (moved > other.report.extrapolated_max) {
      const VehicleAgent& agent = simulation_.vehicle(number);
      other.report.extrapolated_max = moved;
      other.report.extrapolation_bound =
          extrapolation_bound(agent.settings(), bounding_radius(agent.hull()), moved);
    }
  } else if (setup_.on_loss == OnLoss::kHold) {
    RigidBodyState body = other.track.last();
    body.v_world.setZero();
    body.omega_body.setZero();
    met.vehicles[number] = vehicle_of(v, other.flags, body);
  }
}

std::optional<PoseTrack> FleetShare::track(std::size_t vehicle, SimTime from, SimTime until) const {
  const Other& other = others_[vehicle];
  if (decides_together() || !other.there) return std::nullopt;
  return other.track.track(from, until, lease_);
}

}  // namespace pointflight
