#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "pointflight/core/parallel.hpp"

namespace pointflight {

/// A device on a small scene of its own, beside this processor.
class GpuTrial {
 public:
  /// Of the device that `find_gpu` finds. Takes a second or two. Throws InputError if it cannot be
  /// used at all.
  explicit GpuTrial(const std::string& index_or_name);
  ~GpuTrial();
  GpuTrial(const GpuTrial&) = delete;
  GpuTrial& operator=(const GpuTrial&) = delete;

  /// How it divides exactly; empty: no way has the processor's bits.
  [[nodiscard]] const std::string& exact_by() const { return exact_by_; }
  /// Rays of the scene.
  [[nodiscard]] std::size_t rays() const;
  /// Of these have the processor's range, incidence and surfel.
  [[nodiscard]] std::size_t equal() const { return equal_; }
  /// Traces all of them there, and reads back what they hit.
  void trace_on_device();
  /// Traces all of them here.
  void trace_on_processor(const Executor& executor);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  std::string exact_by_;
  std::size_t equal_ = 0;
};

}  // namespace pointflight
