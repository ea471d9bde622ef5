#include "pointflight/view/order_inbox.hpp"

#include <algorithm>
#include <utility>

#include "pointflight/view/page_orders.hpp"

namespace pointflight {

void OrderInbox::Queue::push(Order order) {
  constexpr std::size_t kMostOrders = 1000;  // that wait for a step
  const std::lock_guard lock(mutex);
  if (orders.size() < kMostOrders) orders.push_back(std::move(order));
}

void OrderInbox::take_orders_of(LiveServer& server, const std::vector<MotionLimits>& motions) {
  server.subscribe_json(
      "/pointflight/order", "pointflight.Order", [queue = queue_, motions](const Received& text) {
        queue->push(page_order({reinterpret_cast<const char*>(text.data), text.size}, motions));
      });
}

void OrderInbox::take_playback_of(LiveServer& server, Duration epoch) {
  server.on_playback([queue = queue_, epoch](const foxglove::PlaybackControl& control) {
    if (control.seek) {
      // clients' numbers: before the epoch is the start, and nothing overflows
      const std::int64_t to = std::max(*control.seek, epoch.count());
      queue->push(SeekOrder{SimTime(Duration(to) - epoch)});
    }
    queue->push(RateOrder{static_cast<double>(control.speed)});
    queue->push(PauseOrder{!control.play});
  });
}

foxglove::PlaybackState OrderInbox::state_of(const PlaybackStatus& status, Duration epoch) {
  using Status = foxglove::PlaybackState::Status;
  foxglove::PlaybackState state;
  state.status = status.playing ? Status::kPlaying : Status::kPaused;
  if (status.ended) state.status = Status::kEnded;
  state.time = (status.time.time_since_epoch() + epoch).count();
  state.speed = static_cast<float>(status.rate);
  state.did_seek = status.did_seek;
  return state;
}

std::vector<Order> OrderInbox::take() {
  const std::lock_guard lock(queue_->mutex);
  return std::exchange(queue_->orders, {});
}

}  // namespace pointflight
