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

/// Which one renderers on a GPU use that are made from now on.
struct GpuChoice {
  std::string index_or_name;        ///< As `find_gpu` takes it.
  bool may_be_approximate = false;  ///< One that has not this processor's bits will do.
};
/// "INDEX", "NAME", "approximate" or both with a comma between them. Throws InputError if there is
/// no such device.
void choose_gpu(const std::string& choice);
/// What was chosen.
GpuChoice chosen_gpu();

}  // namespace pointflight
