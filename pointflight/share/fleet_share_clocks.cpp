// Of a process of a shared run: whose clock says what, and how far this one is behind.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pointflight/share/conversion.hpp"
#include "pointflight/share/fleet_share.hpp"

namespace pointflight {
namespace {

using share_msg::Kind;
using share_msg::Phase;

constexpr std::int64_t kClockPeriod = 100 * kMillisecond;
constexpr std::int64_t kMostAdjustment = 5 * kMillisecond;  // of the pace, per clock message
constexpr std::int64_t kLeastAdjustment = kMillisecond;

}  // namespace

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
    peer.offset.emplace(offset, reading->error);
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

}  // namespace pointflight
