#pragma once

#include "pointflight/gpu/internal/device_commands.hpp"

namespace pointflight {

/// Copies bytes to buffers of the device's own, part by part.
class DeviceUpload {
 public:
  /// The device must outlive it. Throws GpuError.
  explicit DeviceUpload(GpuDevice& device);

  /// A buffer that holds `bytes` from `data` on and has room for `beyond` more. Throws GpuError.
  GpuBuffer made_of(const void* data, std::uint64_t bytes, std::uint64_t beyond);

 private:
  GpuDevice& device_;
  GpuBuffer staging_;
  DeviceCommands commands_;
};

}  // namespace pointflight
