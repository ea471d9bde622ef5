// What the two halves of the bridge share: bridge.cpp knows outlets and clocks, bridge_samples.cpp
// makes messages of samples.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "pointflight/core/time.hpp"
#include "ros_common/bridge.hpp"
#include "ros_common/codec.hpp"

namespace pointflight {

struct RosBridge::Stream : OutputStream {
  explicit Stream(OutputStream stream)
      : OutputStream(std::move(stream)), schedule(settings.rate > 0.0 ? settings.rate : 1.0) {}

  Schedule schedule;
  std::optional<SimTime> first;  ///< Sample: the schedule counts from it.
  std::int64_t next = 0;         ///< Of the schedule.
  std::vector<int> numbers;      ///< At each outlet.
  std::uint32_t sent = 0;
  int served = 0;              ///< Readers that have got what there is.
  int newcomer_calls = 0;      ///< Since there are more of them.
  Bytes last_ros1, last_cdr;   ///< Of a scan, where it may have to be sent again.
  std::int64_t last_time = 0;  ///< When it left.
  msg::Path path;              ///< Of paths and trajectories.
  void add_to_path(const msg::Header& header, const Pose& pose);
  double path_spacing = 0.1;  ///< m between its poses.
};

template <class M>
void RosBridge::send(Stream& stream, M message, SimTime leaves) {
  if constexpr (requires { message.header; }) message.header.seq = stream.sent;
  ++stream.sent;
  latest_ = std::max(latest_, leaves);  // outlets see time go one way
  const std::int64_t time = (latest_.time_since_epoch() + epoch_).count();
  Bytes ros1;
  Bytes cdr;
  // transports keep the latter for whoever comes
  const bool always = stream.type->kind == OutputKind::kTfStatic;
  for (std::size_t i = 0; i < outlets_.size(); ++i) {
    if (!always && !outlets_[i]->has_readers(stream.numbers[i])) continue;
    Bytes& bytes = outlets_[i]->wire() == Wire::kRos1 ? ros1 : cdr;
    if (!bytes) {
      bytes = std::make_shared<const std::vector<std::byte>>(outlets_[i]->wire() == Wire::kRos1
                                                                 ? encode<Wire::kRos1>(message)
                                                                 : encode<Wire::kCdr>(message));
    }
    outlets_[i]->send(stream.numbers[i], bytes, time);
  }
  if (keeps_scans_ && stream.type->per == OutputType::Per::kLidar) {
    stream.last_ros1 = ros1;
    stream.last_cdr = cdr;
    stream.last_time = time;
    stream.served = reader_count(stream);
  }
}

}  // namespace pointflight
