#include "pointflight/gpu/internal/device_queue.hpp"

#include <algorithm>
#include <utility>

namespace pointflight {

DeviceQueue::DeviceQueue(std::shared_ptr<GpuDevice> device,
                         const SurfelMap& map,
                         const RayKernel& kernel)
    : device_(std::move(device)), map_(*device_, map), tracer_(*device_, map_, kernel) {}

void DeviceQueue::require_device() const {
  if (is_lost_) throw GpuError(device_->info().name, VK_ERROR_DEVICE_LOST);
}

DeviceBatch::AtOnce DeviceQueue::at_once() const {
  const std::lock_guard lock(mutex_);
  return {tracer_.beams_at_once(), tracer_.wide_at_once()};
}

double DeviceQueue::kernel_time() const {
  const std::lock_guard lock(mutex_);
  return kernel_time_;
}

void DeviceQueue::start(Ticket& ticket) {
  const std::lock_guard lock(mutex_);
  require_device();
  try {
    send_while_free(ticket);
  } catch (const GpuError&) {
    is_lost_ = true;
    throw;
  }
}

void DeviceQueue::finish(Ticket& ticket) {
  const std::lock_guard lock(mutex_);
  require_device();
  try {
    while (ticket.taken < ticket.batch->parts()) {
      send_while_free(ticket);
      take_oldest();
    }
  } catch (const GpuError&) {
    is_lost_ = true;
    throw;
  }
}

void DeviceQueue::send_while_free(Ticket& ticket) {
  while (ticket.sent < ticket.batch->parts() && on_way_.size() < RayTracer::kSlots) {
    const auto is_free = [&](std::size_t slot) {
      return std::none_of(
          on_way_.begin(), on_way_.end(), [&](const Sent& sent) { return sent.slot == slot; });
    };
    const std::size_t slot = tracer_.slot_for(ticket.batch->beams_of(ticket.sent), is_free);
    ticket.batch->send(ticket.sent, slot, tracer_);
    on_way_.push_back({&ticket, ticket.sent, slot});
    ++ticket.sent;
  }
}

void DeviceQueue::take_oldest() {
  const Sent sent = on_way_.front();
  tracer_.wait(sent.slot);
  on_way_.pop_front();
  kernel_time_ += tracer_.kernel_time();
  sent.ticket->batch->take(sent.part, sent.slot, tracer_);
  ++sent.ticket->taken;
}

void DeviceQueue::forget(const Ticket& ticket) noexcept {
  const std::lock_guard lock(mutex_);
  for (auto sent = on_way_.begin(); sent != on_way_.end();) {
    if (sent->ticket != &ticket) {
      ++sent;
      continue;
    }
    try {
      if (!is_lost_) tracer_.wait(sent->slot);
    } catch (const GpuError&) {
      is_lost_ = true;
    }
    sent = on_way_.erase(sent);
  }
}

}  // namespace pointflight
