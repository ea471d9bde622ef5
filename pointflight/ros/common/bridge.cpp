#include "pointflight/ros/common/bridge.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace pointflight {
namespace {

constexpr Duration kLookPeriod = std::chrono::milliseconds(50);

}  // namespace

RosBridge::RosBridge(RunDescription run, const RosProfile& profile, Duration epoch)
    : ros_{.run = std::move(run), .profile = profile, .epoch = epoch},
      next_look_(SimTime{} + kLookPeriod) {
  ros_.map_frame = map_frame_for(ros_.run.map->bounds_world(), profile);
  note_start();
  streams_ = output_streams(ros_);
  ros_.streams = &streams_;
}

void RosBridge::add(Outlet& outlet) {
  ros_.outlets.push_back(&outlet);
  std::map<std::string, int> known;  // several streams may share a topic
  for (OutputStream& stream : streams_) {
    const auto [at, is_new] = known.try_emplace(stream.topic.name, 0);
    if (is_new) at->second = outlet.advertise(stream.topic);
    stream.numbers.push_back(at->second);
  }
}

void RosBridge::start() {
  for (Outlet* outlet : ros_.outlets) outlet->start();
  on_time(SimTime{});  // the clock before anything with a stamp
  for (OutputStream& stream : streams_) stream.output->on_start();
  for (Outlet* outlet : ros_.outlets) outlet->flush();
}

void RosBridge::on_sample(const Sample& sample) {
  if (std::holds_alternative<ObstacleSample>(sample)) {
    send_obstacles();
    obstacles_ = sample;
    return;
  }
  if (const auto* status = std::get_if<StatusSample>(&sample)) {
    ros_.status[status->vehicle] = *status;
  }
  for (OutputStream& stream : streams_) stream.output->on_sample(sample);
}

/// Behind all else of their step.
void RosBridge::send_obstacles() {
  const auto sample = std::exchange(obstacles_, std::nullopt);
  if (!sample) return;
  for (OutputStream& stream : streams_) stream.output->on_sample(*sample);
}

void RosBridge::on_time(SimTime time) {
  send_obstacles();
  for (OutputStream& stream : streams_) stream.output->on_time(time);
  if (time >= next_look_) {
    next_look_ = time + kLookPeriod;
    for (OutputStream& stream : streams_) stream.output->on_look();
  }
  for (Outlet* outlet : ros_.outlets) outlet->flush();
}

void RosBridge::on_wait(SimTime now) {
  // where it stands, which is seldom if the clock's rate put its last message
  now = std::max(ros_.latest, now);
  for (OutputStream& stream : streams_) stream.output->on_wait(now);
  for (OutputStream& stream : streams_) stream.output->on_look();
  for (Outlet* outlet : ros_.outlets) outlet->flush();
}

void RosBridge::resend_scans() {
  constexpr int kCalls = 2000;
  for (OutputStream& stream : streams_) stream.resend(kCalls);
}

void RosBridge::note_start() {
  ros_.status.clear();
  for (const VehicleDescription& vehicle : ros_.run.vehicles) {
    ros_.status.push_back(vehicle.at_start);
  }
}

void RosBridge::shift_epoch(Duration by) {
  note_start();
  ros_.epoch += by;
  ros_.latest = SimTime{};
  next_look_ = SimTime{} + kLookPeriod;
  for (OutputStream& stream : streams_) stream.restart();
}

bool RosBridge::has_scan_readers() const {
  return std::any_of(streams_.begin(), streams_.end(), [](const OutputStream& stream) {
    return stream.type.per == OutputType::Per::kLidar && stream.type.large && stream.is_wanted();
  });
}

void RosBridge::note_refused(std::uint64_t count, const std::string& last) {
  ros_.refused = count;
  ros_.last_refused = last;
}

void RosBridge::note_scan_time(double seconds) {
  ros_.scan_times.push_back(seconds);
  if (ros_.scan_times.size() > kScanTimes) ros_.scan_times.erase(ros_.scan_times.begin());
}

}  // namespace pointflight
