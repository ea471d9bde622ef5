// Of a process of a shared run: what happened while it and another did not hear each other.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "pointflight/share/conversion.hpp"
#include "pointflight/share/fleet_share.hpp"

namespace pointflight {
namespace {

using share_msg::Kind;

constexpr Duration kPastPatience = std::chrono::seconds(2);
constexpr std::size_t kPastMost = 24'000;                         // states in one message
constexpr Duration kPastSpacing = std::chrono::milliseconds(50);  // at most, if there are more

}  // namespace

/// Its newest states; thinned out so that more time is in them, but not so far that what flies fast
/// would jump.
void FleetShare::send_past(Peer& peer) {
  const SimTime from = peer.lost_at - 2 * lease_;
  const auto first = std::find_if(
      past_.begin(), past_.end(), [from](const OwnPast& past) { return past.time >= from; });
  const std::size_t vehicles = options_.vehicles.size();  // an instant has all of them
  const std::size_t instants = static_cast<std::size_t>(past_.end() - first) / vehicles;
  share_msg::Past message;
  message.head.kind = Kind::kPast;
  message.head.process = options_.id;
  message.to = peer.intro.head.process;
  if (instants > 0) {
    const std::size_t most = std::max<std::size_t>(1, kPastMost / vehicles);
    const auto spacing =
        std::max(step_, (past_.back().time - first->time) / static_cast<std::int64_t>(instants));
    const auto widest = static_cast<std::size_t>(std::max<std::int64_t>(1, kPastSpacing / spacing));
    const std::size_t stride = std::min((instants + most - 1) / most, widest);
    for (std::size_t i = instants - std::min(instants, most * stride); i < instants; i += stride) {
      for (std::size_t k = 0; k < vehicles; ++k) {
        const OwnPast& past = first[static_cast<std::ptrdiff_t>(i * vehicles + k)];
        message.states.push_back({to_ns(past.time), past.state});
      }
    }
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

/// It may have come before the states that it is asked for by.
void FleetShare::look_back_if_asked(Peer& peer) {
  if (!peer.past) return;
  look_back(peer);
  peer.past.reset();
}

/// What a process says of its past, of those of its vehicles that were lost and are back.
void FleetShare::look_back(Peer& peer) {
  std::map<std::uint32_t, RemoteTrack> tracks;
  for (const share_msg::PastState& state : peer.past->states) {
    const auto& its = peer.intro.vehicles;
    const RigidBodyState body = body_of(state.state);
    if (std::find(its.begin(), its.end(), state.state.number) == its.end()) continue;
    if (is_plausible(body) && share_msg::is_time(state.time))
      tracks[state.state.number].add_past(to_time(state.time), body);
  }
  for (auto& [number, track] : tracks) {
    Other& other = others_[number];
    if (track.empty() || past_.empty()) continue;
    if (std::exchange(other.asks_past, false)) find_missed(number, track);
  }
}

/// Contacts of own vehicles with one that was not heard of.
void FleetShare::find_missed(std::uint32_t number, const RemoteTrack& track) {
  Other& other = others_[number];
  // what is forgotten by now may have had contacts in it
  const SimTime known_from = std::max(past_.front().time, track.oldest());
  if (known_from > other.lost_at + lease_) ++other.report.unknown_contacts;
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
      ++other.report.missed_contacts;
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
    ++other.report.unknown_contacts;
  }
}

}  // namespace pointflight
