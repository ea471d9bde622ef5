#include "pointflight/ros/common/ros_link.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

/// Looks (20 ms each) that a planner must have been there for: a reader that we know of may not
/// know of us yet.
constexpr int kSettledLooks = 25;

}  // namespace

RosLink::RosLink(const RunDescription& run, const RosProfile& profile, RosLinkOptions options)
    : options_(std::move(options)), inbox_(run, profile), bridge_(run, profile, options_.epoch) {
  if (!options_.log) options_.log = [](const std::string&) {};
  if (options_.lockstep) bridge_.keep_scans();
}

RosLink::~RosLink() {
  close_transports();
}

void RosLink::add_transport(std::unique_ptr<Transport> transport) {
  bridge_.add(*transport);
  inbox_.connect(*transport);
  transports_.push_back(std::move(transport));
}

void RosLink::add_recording(std::unique_ptr<Outlet> recording) {
  bridge_.add(*recording);
  recordings_.push_back({std::move(recording), false});
}

void RosLink::open(const RunDescription& /*run*/) {
  bridge_.start();
  say_failed_recordings();  // of what is latched
}

bool RosLink::has_planner() const {
  return bridge_.has_scan_readers() &&
         std::any_of(transports_.begin(), transports_.end(), [](const auto& transport) {
           return transport->has_senders();
         });
}

bool RosLink::is_ready() {
  for (const auto& transport : transports_) {
    if (!options_.waits || transport->is_connected()) continue;
    if (const std::string why = transport->failure(); !why.empty()) throw InputError(why);
    return false;
  }
  if (!options_.lockstep || transports_.empty() || settled_ >= kSettledLooks) return true;
  awaits_planner_ = true;
  settled_ = has_planner() ? settled_ + 1 : 0;
  if (settled_ == 0 && !std::exchange(said_waiting_, true)) {
    options_.log("lockstep: waiting for somebody who reads scans and sends commands");
  }
  if (settled_ < kSettledLooks) return false;
  if (said_waiting_) options_.log("lockstep: a planner is there");
  return true;
}

void RosLink::on_step(const StepDone& step) {
  // recordings know no wall clock
  if (step.scans > 0 && !transports_.empty() && recordings_.empty()) {
    bridge_.note_scan_time(step.took / static_cast<double>(step.scans));
  }
  bridge_.on_time(step.time);
  say_refused();
  say_failed_recordings();
}

void RosLink::on_wait(SimTime now, Waiting why) {
  say_refused();
  if (why == Waiting::kForAnswer) return bridge_.resend_scans();
  if (why == Waiting::kForLinks && !awaits_planner_) return;
  bridge_.on_wait(now);
}

std::vector<Order> RosLink::take_orders() {
  return inbox_.take();
}

std::string RosLink::remedy_when_behind(double rate) const {
  if (!options_.needs_clock) return {};
  return fmt::format(
      "--rate {:.1f} with --sim-time and use_sim_time in all nodes (of our launch files: "
      "sim_time:=true), or --lockstep",
      rate);
}

/// The first of each kind at once, their number in the end.
void RosLink::say_refused() {
  for (const std::string& reason : inbox_.take_new_reasons()) {
    options_.log(fmt::format("warning: {}; left out (said once, counted)", reason));
  }
  const Inbox::Refused refused = inbox_.refused();
  if (refused.count == told_refused_) return;
  told_refused_ = refused.count;
  bridge_.note_refused(refused.count, refused.last);
}

void RosLink::say_failed_recordings() {
  for (StoredOutlet& recording : recordings_) {
    const std::string why = recording.outlet->failure();
    if (why.empty() || std::exchange(recording.told, true)) continue;
    options_.log(fmt::format("warning: the recording ends here: {}", why));
  }
  in_use_ = !transports_.empty() ||
            std::any_of(recordings_.begin(), recordings_.end(), [](const StoredOutlet& recording) {
              return !recording.told;
            });
}

void RosLink::on_reset(SimTime reached) {
  // stamps never go back: others would drop everything
  bridge_.shift_epoch(reached.time_since_epoch() + std::chrono::seconds(1));
}

void RosLink::on_seek(SimTime /*to*/) {
  bridge_.shift_epoch(Duration{});  // schedules start anew, stamps are the recorded ones
}

void RosLink::close() {
  for (StoredOutlet& recording : recordings_) recording.outlet->close();
  say_failed_recordings();
  close_transports();
  for (const auto& transport : transports_) {
    if (const std::string why = transport->failure(); !why.empty()) options_.log(why);
  }
  if (dropped() > 0) {
    options_.log(fmt::format("{} messages were dropped for slow subscribers", dropped()));
  }
  if (const Inbox::Refused refused = inbox_.refused(); refused.count > 0) {
    options_.log(
        fmt::format("{} messages were left out; the last: {}", refused.count, refused.last));
  }
}

void RosLink::close_transports() {
  for (const auto& transport : transports_) {
    transport->close();
    if (!transport->has_ended() && options_.on_left_behind) options_.on_left_behind();
  }
}

bool RosLink::is_over() const {
  return std::any_of(transports_.begin(), transports_.end(), [](const auto& transport) {
    return transport->is_over();
  });
}

bool RosLink::has_failed(std::size_t recording) const {
  return !recordings_[recording].outlet->failure().empty();
}

std::uint64_t RosLink::dropped() const {
  std::uint64_t dropped = 0;
  for (const auto& transport : transports_) dropped += transport->dropped();
  return dropped;
}

}  // namespace pointflight
