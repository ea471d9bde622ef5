#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "pointflight/run/order.hpp"
#include "pointflight/run/playback.hpp"
#include "pointflight/vehicle/mission.hpp"
#include "pointflight/view/live_server.hpp"

namespace pointflight {

/// Orders of a server's clients, until somebody takes them: what they publish on
/// `/pointflight/order` (`page_order`), and playback controls of Foxglove's protocol.
class OrderInbox {
 public:
  /// From now on clients may publish; `motions`: how each vehicle flies to goals, none if there
  /// are no vehicles to command. Once for a server.
  void take_orders_of(LiveServer& server, const std::vector<MotionLimits>& motions);
  /// Playback controls become orders as well; `epoch`: what the run's first instant is stamped
  /// with.
  void take_playback_of(LiveServer& server, Duration epoch);

  /// What clients are told of a playback whose first instant is stamped with `epoch`.
  static foxglove::PlaybackState state_of(const PlaybackStatus& status, Duration epoch);

  /// All since the last call, in the order in which they came.
  std::vector<Order> take();

 private:
  /// Shared with the handlers, which live as long as the server.
  struct Queue {
    void push(Order order);
    std::mutex mutex;
    std::vector<Order> orders;
  };
  std::shared_ptr<Queue> queue_ = std::make_shared<Queue>();
};

}  // namespace pointflight
