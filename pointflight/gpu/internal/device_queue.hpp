#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>

#include "pointflight/gpu/internal/device_batch.hpp"

namespace pointflight {

/// A device with a map, and the parts of batches that are on their way to it. Callable from several
/// threads. Once a call has thrown GpuError all further ones do.
class DeviceQueue {
 public:
  /// Throws GpuError, InputError.
  DeviceQueue(std::shared_ptr<GpuDevice> device, const SurfelMap& map, const RayKernel& kernel);

  /// How far a batch has come.
  struct Ticket {
    DeviceBatch* batch = nullptr;
    std::size_t sent = 0;
    std::size_t taken = 0;
  };
  /// Sends as many parts of a batch as there are slots free. Throws GpuError.
  void start(Ticket& ticket);
  /// Sends the rest and takes all of it, and of others what lies before. Throws GpuError.
  void finish(Ticket& ticket);
  /// Nothing of it is taken any more.
  void forget(const Ticket& ticket) noexcept;
  /// How many beams are best sent together.
  [[nodiscard]] DeviceBatch::AtOnce at_once() const;
  /// How long kernels have taken in all, s.
  [[nodiscard]] double kernel_time() const;

 private:
  struct Sent {
    Ticket* ticket;
    std::size_t part;
    std::size_t slot;
  };
  void send_while_free(Ticket& ticket);
  void take_oldest();
  void require_device() const;

  std::shared_ptr<GpuDevice> device_;
  DeviceMap map_;
  RayTracer tracer_;
  mutable std::mutex mutex_;
  std::deque<Sent> on_way_;  ///< The oldest first.
  double kernel_time_ = 0.0;
  bool is_lost_ = false;
};

}  // namespace pointflight
