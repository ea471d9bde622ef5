#include "pointflight/share/fleet_share.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "pointflight/core/input_error.hpp"
#include "pointflight/share/common_ground.hpp"
#include "pointflight/share/conversion.hpp"

namespace pointflight {
namespace {

using share_msg::Kind;
using share_msg::Phase;

constexpr std::int64_t kSayWaiting = 2000 * kMillisecond;
constexpr std::int64_t kClockPatience = 3000 * kMillisecond;
constexpr std::int64_t kIntroducePeriod = 500 * kMillisecond;  // while joining
constexpr std::size_t kPeersMost = 1000;
constexpr std::size_t kPartsMost = 32;
constexpr std::size_t kWordMost = 100;  // characters of others' names
constexpr std::size_t kForeignSaid = 5;
constexpr std::uint64_t kForeignMost = 1000;  // messages of a writer

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
      patience_(3 * lease_.count()),
      step_(from_seconds(simulation.scenario().physics_step)),
      schedule_(setup_.time == ShareTime::kFree
                    ? std::min(setup_.rate, 1.0 / simulation.scenario().physics_step)
                    : 100.0),
      parts_(common_ground(simulation, setup_.time == ShareTime::kFree ? options_.rate : 0.0)),
      others_(simulation.vehicle_count()) {
  for (std::size_t v = 0; v < others_.size(); ++v) {
    others_[v].report.vehicle = static_cast<std::uint32_t>(v);
    any_may_stop_ =
        any_may_stop_ || simulation.vehicle(v).setup().on_collision == CollisionReaction::kStop;
  }
  met_.vehicles.resize(others_.size());
  std::vector<std::size_t>& own = options_.vehicles;
  std::sort(own.begin(), own.end());
  own.erase(std::unique(own.begin(), own.end()), own.end());
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
  transport_.send(ShareChannel::kMembers, bytes_of(intro));
}

/// While joining: whoever could not take this process at first may have changed its mind.
void FleetShare::keep_introducing() {
  if (options_.steady() - introduced_at_ > kIntroducePeriod) introduce(phase_);
}

/// Nothing for one that nobody knows, and for one in whose name somebody else speaks.
FleetShare::Peer* FleetShare::peer_of(std::uint64_t process, std::uint64_t writer) {
  const auto found = peers_.find(process);
  if (found == peers_.end()) return nullptr;
  if (found->second.writer == writer) {
    found->second.spoke = options_.steady();
    return &found->second;
  }
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
    case Kind::kBeat:
      return take_beat(arrival);
  }
  note_foreign(arrival.writer, "a message of an unknown kind");
}

/// Counted; said once for each writer, and for a few of them. Who sends nothing else is not read
/// any more: a flood must not hold up the run.
void FleetShare::note_foreign(std::uint64_t writer, const std::string& what) {
  ++foreign_;
  const auto known = foreign_of_.find(writer);
  if (known == foreign_of_.end() && foreign_of_.size() >= kPeersMost) return;
  const std::uint64_t count = ++foreign_of_[writer];
  const bool is_said = foreign_of_.size() <= kForeignSaid;
  if (count == 1 && is_said) {
    options_.log(fmt::format(
        "warning: --share {}: somebody sends {}; left out (said once)", options_.run, what));
  }
  const bool is_peer = std::any_of(peers_.begin(), peers_.end(), [writer](const auto& entry) {
    return entry.second.fits && entry.second.writer == writer;
  });
  if (is_peer || count != kForeignMost) return;
  transport_.ignore(writer);
  if (is_said) {
    options_.log(
        fmt::format("warning: --share {}: {} messages of that kind came from one program; "
                    "nothing of it is read any more",
                    options_.run,
                    count));
  }
}

/// Of two that cannot both fly: the one that has flown for longer by the run's own time.
bool FleetShare::is_older(const Peer& peer) const {
  return std::pair(peer.intro.begins_at, peer.intro.head.process) <
         std::pair(own_.begins_at, options_.id);
}

bool FleetShare::has_sane_shape(const share_msg::Introduction& intro) const {
  const auto is_step = [this](std::int64_t time) {  // lockstep begins and waits with a whole one
    return share_msg::is_time(time) && (!decides_together() || time % step_.count() == 0);
  };
  std::vector<char> named(others_.size(), 0);
  for (const std::uint32_t v : intro.vehicles) {
    if (v >= named.size() || std::exchange(named[v], 1) != 0) return false;
  }
  return !intro.vehicles.empty() && intro.phase <= Phase::kLeft &&
         intro.parts.size() <= kPartsMost && is_step(intro.begins_at) && is_step(intro.waits_at) &&
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
  if (!describes_alike(intro->parts, parts_)) {
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
  peer.spoke = options_.steady();
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
  if (!decides_together() || !peer.lost || peer.intro.phase != Phase::kJoining) return;
  if (options_.steady() >= peer.back_from) recover(peer);
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
void FleetShare::recheck_other_peers() {
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

/// Names of those that have no process.
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
    // who is started again is not heard before the others have given its predecessor up
    const std::int64_t patience = std::max(kClockPatience, lease_.count() + kClockPatience / 3);
    if (peer.flies() && !peer.clock.at(now) && looked < patience) return false;
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
  const auto missing = missing_vehicles();
  // before the first step nobody may be missing, or it would not be that of one process
  if (any_flies ? all_wait && settled : flown_ || missing.empty()) return true;
  if (options_.steady() - said_waiting_ > kSayWaiting) {
    said_waiting_ = std::numeric_limits<std::int64_t>::max() / 2;
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
  const bool is_alone = std::none_of(peers_.begin(), peers_.end(), [](const auto& entry) {
    return entry.second.fits && !entry.second.lost && entry.second.intro.phase != Phase::kLeft;
  });
  if (is_alone && !decides_together()) {
    options_.log(fmt::format("--share {}: flies, and hears nobody else yet", options_.run));
  }
}

void FleetShare::leave() {
  if (phase_ == Phase::kLeft || !introduced_) return;
  introduce(Phase::kLeft);  // `now_` is that of the last step
  if (!decides_together()) return;
  transport_.repeat({});
  for (int k = 0; k < 4; ++k) {  // nobody could ask for the last step again
    for (const Bytes& bytes : last_sent_) transport_.send(ShareChannel::kStates, bytes);
    transport_.wait(kMillisecond);
  }
}

std::vector<FleetShare::PeerReport> FleetShare::peers() const {
  std::vector<PeerReport> reports;
  for (const auto& [id, peer] : peers_) {
    if (!peer.fits) continue;
    PeerReport& report = reports.emplace_back();
    report.process = peer.intro.name;
    report.vehicles.assign(peer.intro.vehicles.begin(), peer.intro.vehicles.end());
    report.received = peer.received;
    report.missing = peer.missing;
    if (!peer.offset) continue;
    report.offset = 1e-9 * static_cast<double>(peer.offset->first);
    report.offset_error = 1e-9 * static_cast<double>(peer.offset->second);
  }
  return reports;
}

}  // namespace pointflight
