#include "share/fleet_share.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/input_error.hpp"
#include "share/common_ground.hpp"

namespace pointflight {
namespace {

using share_msg::Kind;
using share_msg::Phase;

constexpr std::int64_t kMillisecond = 1'000'000;  // ns
constexpr std::int64_t kClockPeriod = 100 * kMillisecond;
constexpr std::int64_t kMostAdjustment = 5 * kMillisecond;  // of the pace, per clock message
constexpr std::int64_t kLeastAdjustment = kMillisecond;
constexpr std::int64_t kResend = 50 * kMillisecond;  // in lockstep, while nothing comes
constexpr std::int64_t kSayWaiting = 2000 * kMillisecond;
constexpr std::int64_t kClockPatience = 3000 * kMillisecond;
constexpr Duration kPastKept = std::chrono::seconds(120);
constexpr Duration kPastPatience = std::chrono::seconds(2);
constexpr std::size_t kPastMost = 4000;  // states in one message
constexpr std::size_t kPeersMost = 1000;
constexpr std::size_t kPartsMost = 32;
constexpr std::size_t kResentMost = 8;                         // messages
constexpr std::int64_t kIntroducePeriod = 500 * kMillisecond;  // while joining
constexpr double kJump = 0.1;           // s moved on, after which a vehicle may be elsewhere
constexpr std::size_t kWordMost = 100;  // characters of others' names
constexpr int kForeignSaid = 5;
constexpr double kFarthest = 1e7;  // m

SimTime to_time(std::int64_t ns) {
  return SimTime(Duration(ns));
}

std::int64_t to_ns(SimTime time) {
  return time.time_since_epoch().count();
}

template <class M>
Bytes bytes_of(const M& message) {
  return std::make_shared<const std::vector<std::byte>>(encode<Wire::kCdr>(message));
}

share_msg::VehicleState state_of(const SharedVehicle& vehicle) {
  using State = share_msg::VehicleState;
  const RigidBodyState& b = vehicle.body;
  const Quaterniond& q = b.q_world_body;
  State state;
  state.number = vehicle.number;
  state.flags = (vehicle.crashed ? State::kCrashed : 0u) |
                (vehicle.arrived ? State::kArrived : 0u) |
                (vehicle.commanded ? State::kCommanded : 0u);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    state.position[i] = b.p_world[k];
    state.velocity[i] = b.v_world[k];
    state.body_rate[i] = b.omega_body[k];
  }
  state.orientation = {q.w(), q.x(), q.y(), q.z()};
  return state;
}

RigidBodyState body_of(const share_msg::VehicleState& s) {
  RigidBodyState body;
  body.p_world = Vector3d(s.position.data());
  body.v_world = Vector3d(s.velocity.data());
  body.omega_body = Vector3d(s.body_rate.data());
  body.q_world_body =
      Quaterniond(s.orientation[0], s.orientation[1], s.orientation[2], s.orientation[3]);
  return body;
}

SharedVehicle vehicle_of(std::uint32_t number, std::uint32_t flags, const RigidBodyState& body) {
  using State = share_msg::VehicleState;
  SharedVehicle vehicle;
  vehicle.number = number;
  vehicle.body = body;
  vehicle.crashed = (flags & State::kCrashed) != 0;
  vehicle.arrived = (flags & State::kArrived) != 0;
  vehicle.commanded = (flags & State::kCommanded) != 0;
  return vehicle;
}

/// Figures that a vehicle can have.
bool is_plausible(const RigidBodyState& body) {
  return body.is_finite() && body.p_world.cwiseAbs().maxCoeff() < kFarthest &&
         body.v_world.norm() < 1e4 && body.omega_body.norm() < 1e4 &&
         std::abs(body.q_world_body.norm() - 1.0) < 1e-3;
}

/// Of another program's words, for a line of ours.
std::string printable(std::string text) {
  if (text.size() > kWordMost) text.resize(kWordMost);
  for (char& c : text) {
    if (c < ' ' || c > '~') c = '?';
  }
  return text;
}

}  // namespace

FleetShare::FleetShare(const Simulation& simulation,
                       ShareTransport& transport,
                       FleetShareOptions options)
    : simulation_(simulation),
      transport_(transport),
      options_(std::move(options)),
      setup_(share_setup_of(simulation.scenario())),
      lease_(from_seconds(setup_.lease)),
      step_(from_seconds(simulation.scenario().physics_step)),
      schedule_(setup_.time == ShareTime::kFree
                    ? std::min(setup_.rate, 1.0 / simulation.scenario().physics_step)
                    : 100.0),
      parts_(common_ground(simulation, setup_.time == ShareTime::kFree ? options_.rate : 0.0)),
      others_(simulation.vehicle_count()) {
  for (std::size_t v = 0; v < others_.size(); ++v) {
    others_[v].summary.vehicle = static_cast<std::uint32_t>(v);
  }
  std::sort(options_.vehicles.begin(), options_.vehicles.end());
}

FleetShare::~FleetShare() {
  try {
    leave();
  } catch (...) {  // a run that ends by an error has said why
  }
}

bool FleetShare::decides_together() const {
  return setup_.time == ShareTime::kLockstep;
}

// ---- who takes part ----

void FleetShare::introduce(Phase phase) {
  phase_ = phase;
  share_msg::Introduction& intro = own_;
  intro.head.kind = Kind::kIntroduction;
  intro.head.process = options_.id;
  intro.name = options_.process;
  intro.phase = phase;
  intro.vehicles.assign(options_.vehicles.begin(), options_.vehicles.end());
  intro.parts = parts_;
  intro.stops = simulation_.end() == RunEnd::kCollision;
  intro.ends_at = to_ns(now_);
  introduced_at_ = options_.steady();
  transport_.send(ShareChannel::kCrew, bytes_of(intro));
}

/// While joining: whoever could not take this process at first may have changed its mind.
void FleetShare::keep_introducing() {
  if (options_.steady() - introduced_at_ > kIntroducePeriod) introduce(phase_);
}

/// Nothing for one that nobody knows, and for one in whose name somebody else speaks.
FleetShare::Peer* FleetShare::peer_of(std::uint64_t process, std::uint64_t writer) {
  const auto found = peers_.find(process);
  if (found == peers_.end()) return nullptr;
  if (found->second.writer == writer) return &found->second;
  note_foreign(writer, "messages in another process' name");
  return nullptr;
}

void FleetShare::receive() {
  for (const ShareArrival& arrival : transport_.take()) take(arrival);
}

void FleetShare::take(const ShareArrival& arrival) {
  if (arrival.bytes.empty()) {
    lose_writer(arrival.writer);
    return;
  }
  const share_msg::Opened opened = share_msg::open_message(arrival.bytes);
  if (!opened.head) {
    note_foreign(arrival.writer, opened.fault);
    return;
  }
  if (opened.head->process == options_.id) return;
  switch (opened.head->kind) {
    case Kind::kIntroduction:
      return take_introduction(arrival);
    case Kind::kStates:
      return take_states(arrival);
    case Kind::kClock:
      return take_clock(arrival);
    case Kind::kPast:
      return take_past(arrival);
  }
  note_foreign(arrival.writer, "a message of an unknown kind");
}

/// Counted; said once for each writer, and for a few of them.
void FleetShare::note_foreign(std::uint64_t writer, const std::string& what) {
  ++foreign_;
  if (said_foreign_.size() >= kPeersMost || !said_foreign_.emplace(writer, true).second) return;
  if (said_foreign_.size() > kForeignSaid) return;
  options_.log(fmt::format(
      "warning: --share {}: somebody sends {}; left out (said once)", options_.run, what));
}

/// Of two that cannot both fly: the one that has flown for longer by the run's own time.
bool FleetShare::is_older(const Peer& peer) const {
  return std::pair(peer.intro.begins_at, peer.intro.head.process) <
         std::pair(own_.begins_at, options_.id);
}

bool FleetShare::has_sane_shape(const share_msg::Introduction& intro) const {
  std::vector<char> named(others_.size(), 0);
  for (const std::uint32_t v : intro.vehicles) {
    if (v >= named.size() || std::exchange(named[v], 1) != 0) return false;
  }
  return !intro.vehicles.empty() && intro.phase <= Phase::kLeft &&
         intro.parts.size() <= kPartsMost && share_msg::is_time(intro.begins_at) &&
         share_msg::is_time(intro.waits_at) &&
         (intro.ends_at == -1 || share_msg::is_time(intro.ends_at));
}

void FleetShare::take_introduction(const ShareArrival& arrival) {
  const auto intro = decode<Wire::kCdr, share_msg::Introduction>(arrival.bytes);
  if (!intro || !has_sane_shape(*intro)) {
    note_foreign(arrival.writer, "an introduction that makes no sense");
    return;
  }
  const auto known = peers_.find(intro->head.process);
  const bool is_new = known == peers_.end();
  if (!is_new &&
      (known->second.writer != arrival.writer || known->second.intro.vehicles != intro->vehicles)) {
    note_foreign(arrival.writer, "an introduction in another process' name");
    return;
  }
  if (is_new && !describes_alike(intro->parts, parts_)) {
    note_foreign(arrival.writer, "an introduction that describes no run of ours");
    return;
  }
  if (is_new && peers_.size() >= kPeersMost) {
    std::erase_if(peers_, [](const auto& entry) { return !entry.second.fits; });
    if (peers_.size() >= kPeersMost) return;
  }
  Peer& peer = peers_[intro->head.process];
  if (is_new) peer.clock = ClockEstimate(options_.rate);
  const Phase before = peer.intro.phase;
  peer.intro = *intro;
  peer.intro.name = printable(peer.intro.name);
  peer.writer = arrival.writer;
  peer.gone = false;
  if (is_new) peer.heard = arrival.at;
  if (peer.intro.phase == Phase::kLeft) {
    // lockstep: not before its last step has been used
    if (peer.fits && before != Phase::kLeft && (!decides_together() || peer.lost)) {
      lose(peer, "left", "has left");
    }
    return;
  }
  const bool fitted = peer.fits;
  check(peer);
  if (!peer.fits) return;
  if (!fitted) say_taken(peer);
  // lockstep: one that was lost comes back by joining again
  if (decides_together() && peer.lost && peer.intro.phase == Phase::kJoining) recover(peer);
}

void FleetShare::say_taken(const Peer& peer) const {
  std::vector<std::string> names;
  for (const std::uint32_t v : peer.intro.vehicles) {
    names.push_back(simulation_.vehicle(v).setup().name);
  }
  options_.log(fmt::format(
      "--share {}: {} flies {}", options_.run, peer.intro.name, fmt::join(names, ", ")));
}

void FleetShare::check(Peer& peer) {
  peer.fits = false;
  const bool flies = peer.intro.phase == Phase::kFlying;
  const bool gives_way =
      phase_ == Phase::kJoining ? flies || is_older(peer) : flies && is_older(peer);
  if (const auto what = difference(peer.intro.parts, parts_)) {
    refuse_or_warn(peer,
                   fmt::format("{} flies in another world: {}", peer.intro.name, printable(*what)),
                   phase_ == Phase::kJoining && gives_way);
    return;
  }
  for (const std::uint32_t v : peer.intro.vehicles) {
    if (!std::binary_search(options_.vehicles.begin(), options_.vehicles.end(), v)) continue;
    refuse_or_warn(peer,
                   fmt::format("{} flies {} (vehicle {}) too; give each process other --vehicles",
                               peer.intro.name,
                               simulation_.vehicle(v).setup().name,
                               v),
                   gives_way);
    return;
  }
  for (const auto& [id, other] : peers_) {
    if (id == peer.intro.head.process || !other.fits || other.lost) continue;
    if (other.intro.phase == Phase::kLeft) continue;
    for (const std::uint32_t v : other.intro.vehicles) {
      const auto& theirs = peer.intro.vehicles;
      if (std::find(theirs.begin(), theirs.end(), v) == theirs.end()) continue;
      return;  // the two will resolve it; until then the first one counts
    }
  }
  peer.fits = true;
}

/// This process may not fly, or the other one is left out.
void FleetShare::refuse_or_warn(Peer& peer, const std::string& what, bool refuses) {
  if (refuses) {
    const std::string line = fmt::format("--share {}: {}", options_.run, what);
    if (phase_ == Phase::kJoining && !flown_) {
      introduce(Phase::kLeft);
      throw InputError(line);
    }
    if (fault_.empty()) fault_ = line;
    return;
  }
  if (std::exchange(peer.warned, true)) return;
  options_.log(
      fmt::format("warning: --share {}: {}; it is left out (said once)", options_.run, what));
}

/// A process is gone: who could not be taken beside it may fit now.
void FleetShare::look_again_at_the_rest() {
  for (auto& [id, peer] : peers_) {
    if (peer.fits || peer.gone || peer.intro.phase == Phase::kLeft) continue;
    check(peer);
    if (peer.fits) say_taken(peer);
  }
}

/// Others fly, or did until just now: who has stood still finds all of them silent.
bool FleetShare::has_company() const {
  constexpr std::int64_t kRemembered = 30'000 * kMillisecond;
  const std::int64_t now = options_.steady();
  return std::any_of(peers_.begin(), peers_.end(), [now](const auto& entry) {
    const Peer& peer = entry.second;
    return peer.fits && peer.intro.phase == Phase::kFlying && now - peer.heard < kRemembered;
  });
}

/// Each vehicle of the fleet has its process.
bool FleetShare::has_everybody() const {
  std::size_t count = options_.vehicles.size();
  for (const auto& [id, peer] : peers_) {
    if (peer.fits && !peer.lost && peer.intro.phase != Phase::kLeft) {
      count += peer.intro.vehicles.size();
    }
  }
  return count >= others_.size();
}

std::vector<std::string> FleetShare::missing_vehicles() const {
  std::vector<char> there(others_.size(), 0);
  for (const std::size_t v : options_.vehicles) there[v] = 1;
  for (const auto& [id, peer] : peers_) {
    if (!peer.fits || peer.lost || peer.intro.phase == Phase::kLeft) continue;
    for (const std::uint32_t v : peer.intro.vehicles) there[v] = 1;
  }
  std::vector<std::string> names;
  for (std::size_t v = 0; v < there.size(); ++v) {
    if (there[v] == 0) names.push_back(simulation_.vehicle(v).setup().name);
  }
  return names;
}

bool FleetShare::is_ready() {
  const std::int64_t now = options_.steady();
  if (first_look_ == 0) {
    first_look_ = said_waiting_ = now;
    introduced_ = true;
    introduce(Phase::kJoining);
  }
  receive();
  keep_introducing();
  if (decides_together()) return may_join_steps();
  send_clock();
  const std::int64_t looked = now - first_look_;
  if (looked < options_.settle.count()) return false;
  for (const auto& [id, peer] : peers_) {
    if (peer.flies() && !peer.clock.at(now) && looked < kClockPatience) return false;
  }
  return true;
}

/// Lockstep: all are there and nobody flies yet; or all who fly stand still for this process.
bool FleetShare::may_join_steps() {
  bool any_flies = false;
  bool all_wait = true;
  own_.begins_at = to_ns(simulation_.time());
  for (const auto& [id, peer] : peers_) {
    if (!peer.flies()) continue;
    any_flies = true;
    all_wait = all_wait && peer.intro.waits_for == options_.id;
    own_.begins_at = std::max(own_.begins_at, peer.intro.waits_at);
  }
  const bool settled = options_.steady() - first_look_ >= options_.settle.count();
  // before the first step nobody may be missing, or it would not be that of one process
  const bool complete = has_everybody() || own_.begins_at > 0;
  if (complete && (!any_flies || (all_wait && settled))) return true;
  if (options_.steady() - said_waiting_ > kSayWaiting) {
    said_waiting_ = std::numeric_limits<std::int64_t>::max() / 2;
    const auto missing = missing_vehicles();
    if (!missing.empty() && !any_flies) {
      options_.log(fmt::format("--share {}: waiting for a process that flies {}",
                               options_.run,
                               fmt::join(missing, ", ")));
    }
  }
  return false;
}

SimTime FleetShare::time_of_others() const {
  if (decides_together()) return to_time(own_.begins_at);
  SimTime latest;
  for (const auto& [id, peer] : peers_) {
    if (!peer.flies()) continue;
    if (const auto reading = peer.clock.at(options_.steady())) {
      latest = std::max(latest, to_time(reading->clock));
    }
  }
  return latest;
}

void FleetShare::begin() {
  flown_ = true;
  own_.begins_at = to_ns(simulation_.time());
  next_sent_ = schedule_.first_from(simulation_.time());
  introduce(Phase::kFlying);
}

void FleetShare::leave() {
  if (phase_ == Phase::kLeft || !introduced_) return;
  introduce(Phase::kLeft);  // `now_` is that of the last step
  if (!decides_together()) return;
  for (int k = 0; k < 4; ++k) {  // nobody could ask for the last step again
    for (const Bytes& bytes : last_sent_) transport_.send(ShareChannel::kStates, bytes);
    transport_.wait(kMillisecond);
  }
}

// ---- who is lost, who is back ----

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
    if (!other.there) other.summary.apart += std::max(Duration{0}, now_ - other.lost_at);
    other.lost_at = other.track.empty() ? now_ : std::min(now_, other.track.newest());
    other.there = false;
    if (left) other.seen = false;  // its body goes with it
    if (!left) ++other.summary.losses;
    note(v, kind, fmt::format("{} {}{}", peer.intro.name, words, then));
  }
  look_again_at_the_rest();
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
  other.summary.flown_by = peer.intro.name;
  if (std::exchange(other.there, true)) return;
  other.jumped = true;
  const bool was_seen = std::exchange(other.seen, true);
  if (!was_seen) return;
  const Duration apart = std::max(Duration{0}, now_ - other.lost_at);
  other.summary.apart += apart;
  other.back_at = now_;
  if (same) {
    other.asks_past = true;
  } else {
    ++other.summary.unknown_contacts;
  }
  note(number,
       "back",
       fmt::format("{} is heard again after {:.1f} s{}",
                   peer.intro.name,
                   to_seconds(apart),
                   same ? "" : "; another process than before"));
}

// ---- states ----

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
  if (peer->received > 0 && states->counter > peer->counter) {
    peer->missing += states->counter - peer->counter - 1;
  }
  ++peer->received;
  peer->counter = std::max(peer->counter, states->counter);
  peer->newest = std::max(peer->newest, to_time(states->time));
  if (decides_together()) {
    if (peer->lost && phase_ != Phase::kJoining) return;
    if (peer->lost) recover(*peer);
    const auto said = std::pair(states->time, states->flags & share_msg::States::kVerdict);
    for (const share_msg::States& known : peer->steps) {
      if (std::pair(known.time, known.flags & share_msg::States::kVerdict) == said) return;
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
  if (peer->past) {  // it may have come before the states
    look_back(*peer);
    peer->past.reset();
  }
}

void FleetShare::send_states(const SharedStep& own) {
  share_msg::States states;
  states.head.kind = Kind::kStates;
  states.head.process = options_.id;
  states.counter = counter_++;
  states.time = to_ns(own.time);
  states.end_time = to_ns(own.end_time);
  states.flags = (own.is_landing ? share_msg::States::kLanding : 0u) |
                 (own.stops ? share_msg::States::kStops : 0u) |
                 (own.is_verdict ? share_msg::States::kVerdict : 0u);
  for (const SharedVehicle& vehicle : own.vehicles) states.vehicles.push_back(state_of(vehicle));
  last_sent_.push_back(bytes_of(states));
  while (last_sent_.size() > (decides_together() ? kResentMost : 1)) last_sent_.pop_front();
  transport_.send(ShareChannel::kStates, last_sent_.back());
}

/// For those who were apart: where own vehicles were.
void FleetShare::remember(const SharedStep& own) {
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
    if (moved > other.summary.extrapolated_max) {
      const VehicleAgent& agent = simulation_.vehicle(number);
      other.summary.extrapolated_max = moved;
      other.summary.extrapolation_bound =
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

// ---- lockstep ----

const share_msg::States* FleetShare::step_of(const Peer& peer, SimTime time, bool verdict) {
  for (const share_msg::States& states : peer.steps) {
    const bool is_verdict = (states.flags & share_msg::States::kVerdict) != 0;
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
    if (!said && now - began > kSayWaiting) {
      said = true;
      say_slow(needed, own.is_verdict);
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
    met.is_landing = met.is_landing || (step->flags & States::kLanding) != 0;
    met.stops = met.stops || (step->flags & States::kStops) != 0;
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
  }
  for (std::size_t v = 0; v < others_.size(); ++v) {
    if (!others_[v].there) place(met, v);
  }
  return met;
}

// ---- time ----

void FleetShare::send_clock() {
  const std::int64_t now = options_.steady();
  if (now < next_clock_) return;
  next_clock_ = now + kClockPeriod;
  share_msg::Clock clock;
  clock.head.kind = Kind::kClock;
  clock.head.process = options_.id;
  clock.sent = now;
  const auto own = phase_ == Phase::kFlying ? options_.clock(now) : std::nullopt;
  clock.clock = own ? to_ns(*own) : -1;
  for (const auto& [id, peer] : peers_) {
    if (peer.fits && peer.its_arrival > 0 && now - peer.its_arrival < 10 * kClockPeriod) {
      clock.echoes.push_back({id, peer.its_sent, now - peer.its_arrival});
    }
  }
  transport_.send(ShareChannel::kClock, bytes_of(clock));
}

void FleetShare::take_clock(const ShareArrival& arrival) {
  const auto clock = decode<Wire::kCdr, share_msg::Clock>(arrival.bytes);
  if (!clock || (clock->clock != -1 && !share_msg::is_time(clock->clock))) {
    note_foreign(arrival.writer, "a clock that makes no sense");
    return;
  }
  Peer* peer = peer_of(clock->head.process, arrival.writer);
  if (peer == nullptr || !peer->fits) return;
  peer->its_sent = clock->sent;
  peer->its_arrival = arrival.at;
  if (clock->clock < 0) return;
  for (const share_msg::Echo& echo : clock->echoes) {
    if (echo.process != options_.id) continue;
    peer->clock.add(echo.sent, echo.held, arrival.at, clock->clock);
    break;
  }
}

FleetShare::Adjustment FleetShare::keep_time() {
  if (decides_together()) return rejoin();
  const std::int64_t now = options_.steady();
  if (now < next_clock_) return {};
  send_clock();
  const auto own = options_.clock(now);
  if (!own || phase_ != Phase::kFlying) return {};
  Adjustment adjustment;
  std::int64_t ahead = 0;
  for (auto& [id, peer] : peers_) {
    if (!peer.flies()) continue;
    const auto reading = peer.clock.at(now);
    if (!reading) continue;
    const std::int64_t offset = reading->clock - to_ns(*own);
    ahead = std::max(ahead, offset - reading->error);
    say_offset(id, peer, offset, reading->error);
  }
  // who has stood still, or began while nothing was heard of the others, goes on where they are
  const Duration behind = *own - simulation_.time();
  if (ahead > lease_.count() || (has_company() && behind > lease_)) {
    const Duration skip = behind + Duration(ahead > lease_.count() ? ahead : 0);
    adjustment.skip = (skip + step_ - Duration{1}) / step_ * step_;
    options_.log(fmt::format(
        "warning: --share {}: {:.1f} s behind the others; going on at {:.1f} s, nothing is made up "
        "for",
        options_.run,
        to_seconds(adjustment.skip),
        to_seconds(simulation_.time() + adjustment.skip)));
  } else if (ahead > kLeastAdjustment) {
    const double wall = static_cast<double>(ahead) / options_.rate;
    adjustment.hurry = std::min(Duration(std::llround(wall)), Duration(kMostAdjustment));
  }
  return adjustment;
}

void FleetShare::say_offset(std::uint64_t id,
                            const Peer& peer,
                            std::int64_t offset,
                            std::int64_t error) {
  double scan = 1.0;  // s; the shortest of the own LiDARs'
  for (const std::size_t v : options_.vehicles) {
    for (const MountedLidar* mounted : simulation_.vehicle(v).lidars()) {
      scan = std::min(scan, to_seconds(mounted->schedule().at(1) - mounted->schedule().at(0)));
    }
  }
  if (1e-9 * static_cast<double>(std::abs(offset) - error) < 0.5 * scan) return;
  if (!said_offset_.emplace(id, true).second) return;
  options_.log(
      fmt::format("warning: --share {}: the clock of {} is {:.0f} ms {} this one (+- {:.0f} ms): "
                  "more than half "
                  "a scan (said once)",
                  options_.run,
                  peer.intro.name,
                  1e-6 * static_cast<double>(std::abs(offset)),
                  offset > 0 ? "ahead of" : "behind",
                  1e-6 * static_cast<double>(error)));
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

// ---- what happened while apart ----

void FleetShare::send_past(Peer& peer) {
  const SimTime from = peer.lost_at - 2 * lease_;
  std::vector<share_msg::PastState> states;
  for (const OwnPast& past : past_) {
    if (past.time >= from) states.push_back({to_ns(past.time), past.state});
  }
  const std::size_t stride = states.size() / kPastMost + 1;
  share_msg::Past message;
  message.head.kind = Kind::kPast;
  message.head.process = options_.id;
  message.to = peer.intro.head.process;
  // whole instants: all vehicles of one, then the next
  const std::size_t vehicles = options_.vehicles.size();
  for (std::size_t i = 0; i < states.size(); ++i) {
    if ((i / vehicles) % stride == 0) message.states.push_back(states[i]);
  }
  transport_.send(ShareChannel::kPast, bytes_of(message));
}

void FleetShare::take_past(const ShareArrival& arrival) {
  const auto past = decode<Wire::kCdr, share_msg::Past>(arrival.bytes);
  if (!past) {
    note_foreign(arrival.writer, "a past that makes no sense");
    return;
  }
  Peer* peer = peer_of(past->head.process, arrival.writer);
  if (peer == nullptr || !peer->fits || past->to != options_.id) return;
  peer->past = *past;
  look_back(*peer);
}

/// What a process says of its past, of those of its vehicles that were lost and are back.
void FleetShare::look_back(Peer& peer) {
  std::map<std::uint32_t, OtherTrack> tracks;
  for (const share_msg::PastState& state : peer.past->states) {
    const auto& its = peer.intro.vehicles;
    const RigidBodyState body = body_of(state.state);
    if (std::find(its.begin(), its.end(), state.state.number) == its.end()) continue;
    if (is_plausible(body) && share_msg::is_time(state.time))
      tracks[state.state.number].add_past(to_time(state.time), body);
  }
  for (auto& [number, track] : tracks) {
    Other& other = others_[number];
    if (std::exchange(other.asks_past, false)) find_missed(number, track);
  }
}

/// Contacts of own vehicles with one that was not heard of.
void FleetShare::find_missed(std::uint32_t number, const OtherTrack& track) {
  Other& other = others_[number];
  const VehicleAgent& agent = simulation_.vehicle(number);
  std::map<std::uint32_t, bool> inside;
  for (const OwnPast& past : past_) {
    if (past.time < other.lost_at || past.time > other.back_at) continue;
    const auto there = track.at(past.time, lease_);
    if (!there) continue;
    const VehicleAgent& own = simulation_.vehicle(past.state.number);
    const Pose own_pose = body_of(past.state).T_world_body();
    const auto contact = contact_with_body(
        agent.shape(), there->T_world_body(), agent.label(), own.hull(), own_pose, 0.0);
    const bool meets = contact && contact->distance <= 0.0;
    if (meets && !inside[past.state.number]) {
      ++other.summary.missed_contacts;
      VehicleEvent event;
      event.vehicle = past.state.number;
      event.time = now_;
      event.kind = "missed_contact";
      event.words = fmt::format("was inside {} at {:.2f} s, {:.3f} m deep; nothing was heard of it",
                                agent.setup().name,
                                to_seconds(past.time),
                                -contact->distance);
      event.vehicle_world = own_pose.translation;
      event.partner = agent.label();
      event.penetration = -contact->distance;
      events_.push_back(std::move(event));
    }
    inside[past.state.number] = meets;
  }
}

void FleetShare::give_up_past() {
  for (Other& other : others_) {
    if (!other.asks_past || now_ - other.back_at < kPastPatience) continue;
    other.asks_past = false;
    ++other.summary.unknown_contacts;
  }
}

// ---- reports ----

std::vector<VehicleEvent> FleetShare::take_events() {
  return std::exchange(events_, {});
}

std::vector<ApartSummary> FleetShare::apart() const {
  std::vector<ApartSummary> all;
  for (std::size_t v = 0; v < others_.size(); ++v) {
    if (std::binary_search(options_.vehicles.begin(), options_.vehicles.end(), v)) continue;
    ApartSummary summary = others_[v].summary;
    if (others_[v].seen && !others_[v].there) summary.apart += now_ - others_[v].lost_at;
    all.push_back(std::move(summary));
  }
  return all;
}

std::vector<FleetShare::PeerReport> FleetShare::peers() const {
  std::vector<PeerReport> reports;
  const std::int64_t now = options_.steady();
  const auto own = options_.clock(now);
  for (const auto& [id, peer] : peers_) {
    if (!peer.fits) continue;
    PeerReport& report = reports.emplace_back();
    report.process = peer.intro.name;
    report.vehicles.assign(peer.intro.vehicles.begin(), peer.intro.vehicles.end());
    report.received = peer.received;
    report.missing = peer.missing;
    if (const auto reading = peer.clock.at(now); reading && own) {
      report.offset = 1e-9 * static_cast<double>(reading->clock - to_ns(*own));
      report.offset_error = 1e-9 * static_cast<double>(reading->error);
    }
  }
  return reports;
}

}  // namespace pointflight
