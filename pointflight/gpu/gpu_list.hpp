#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace pointflight {

/// A device that renders.
struct GpuInfo {
  std::size_t index = 0;             ///< In the order of the system's loader.
  std::string name;                  ///< As its driver gives it.
  std::string driver;                ///< Name and version.
  std::string api;                   ///< Version of Vulkan.
  std::uint64_t memory = 0;          ///< Of its own, bytes.
  std::uint64_t largest_buffer = 0;  ///< Bytes.
  std::size_t subgroup = 0;          ///< Lanes.
  bool has_doubles = false;          ///< It computes with doubles.
  bool is_processor = false;         ///< A driver that computes on the processor.
};

/// All of them. Throws InputError if there is no Vulkan loader or no device.
std::vector<GpuInfo> list_gpus();

/// The one with this index or a part of this name; "": the first that is no processor, else the
/// first. Throws InputError that lists them.
GpuInfo find_gpu(const std::string& index_or_name);

/// From now on renderers "gpu" that are made use this one, as `find_gpu` finds it.
void choose_gpu(const std::string& index_or_name);
/// As it was chosen; "" at first.
std::string chosen_gpu();

}  // namespace pointflight
