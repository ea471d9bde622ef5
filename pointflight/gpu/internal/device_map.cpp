#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "pointflight/gpu/internal/device_upload.hpp"
#include "pointflight/gpu/internal/ray_tracer.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"
#include "pointflight/render/internal/cone_kernel.hpp"

namespace pointflight {
namespace {

constexpr std::uint64_t kBeyond = 64;    // bytes behind the words: a leaf may be read as if full
constexpr std::uint64_t kNodeItem = 16;  // bytes: kernels read nodes by quarters of 64
constexpr std::uint64_t kWordItem = sizeof(SurfelWord);

}  // namespace

device::MapNumbers numbers_of(const SurfelMap& map) {
  const KernelMap kernel = kernel_map_of(map);
  device::MapNumbers n{};
  n.r = kernel.r;
  n.r_squared = kernel.scale.r_squared;
  n.position_step = kernel.scale.position_step;
  n.support_squared = kernel.support_squared;
  n.inverse_support = kernel.inverse_support;
  n.weight_scale = kernel.weight_scale;
  n.window = kernel.window;
  n.shares_per_metre = kShareSteps / kernel.window;
  n.widest2 = kernel.scale.widest[2];
  n.widest3 = kernel.scale.widest[3];
  n.tau = kernel.tau;
  n.node_count = static_cast<std::uint32_t>(kernel.node_count);
  std::copy(std::begin(kernel.scale.inverse_thickness),
            std::end(kernel.scale.inverse_thickness),
            std::begin(n.inverse_thickness));
  std::copy(std::begin(kernel.scale.thickness),
            std::end(kernel.scale.thickness),
            std::begin(n.thickness));
  std::copy(std::begin(kernel.scale.inverse_ratio),
            std::end(kernel.scale.inverse_ratio),
            std::begin(n.inverse_ratio));
  std::copy(std::begin(kernel.scale.ratio), std::end(kernel.scale.ratio), std::begin(n.ratio));
  n.support = kernel.support;
  const ConeConstants cone = cone_constants(kernel);
  n.cone_radius = cone.radius;
  n.solid_support = cone.solid_support;
  n.leaf_reach = cone.leaf_reach;
  n.soft_scale = cone.weight_scale;
  n.soft_tau = cone.tau;
  n.depth_steps_per_metre = cone.depth_steps_per_metre;
  n.metres_per_depth_step = cone.metres_per_depth_step;
  n.has_intensity = map.has_intensity() ? 1 : 0;
  for (std::uint32_t code = 0; code < 32; ++code) {
    n.inverse_spread[code] = 1.0f / std::sqrt(variance2_of(code) * n.r_squared);
  }
  return n;
}

namespace {

/// In how many parts of 2^shift items a section goes.
struct Split {
  std::uint32_t shift;
  std::uint64_t part;  ///< Bytes of each but the last.
  std::uint64_t parts;

  Split(std::uint64_t bytes, std::uint64_t item, std::uint64_t largest_buffer)
      : shift(static_cast<std::uint32_t>(std::bit_width(largest_buffer / item)) - 1),
        part(item << shift),
        parts((bytes + part - 1) / part) {
    if (bytes <= largest_buffer) {
      shift = 31;  // no item lies beyond
      part = bytes;
      parts = 1;
    }
  }
};

/// A section's bytes and so many behind them, in buffers.
std::vector<GpuBuffer> uploaded(DeviceUpload& upload,
                                std::span<const std::uint8_t> section,
                                std::uint64_t beyond,
                                const Split& split) {
  std::vector<GpuBuffer> parts;
  for (std::uint64_t k = 0; k < split.parts; ++k) {
    const std::uint64_t at = k * split.part;
    const std::uint64_t end = std::min(section.size() + beyond, at + split.part);
    const std::uint64_t filled = std::min<std::uint64_t>(section.size(), end);
    const std::uint64_t bytes = filled > at ? filled - at : 0;
    parts.push_back(upload.made_of(
        section.data() + std::min<std::uint64_t>(at, section.size()), bytes, end - at - bytes));
  }
  return parts;
}

}  // namespace

DeviceMap::DeviceMap(GpuDevice& device, const SurfelMap& map, std::uint64_t largest_buffer) {
  map.verify();
  const std::span<const std::uint8_t> nodes(
      reinterpret_cast<const std::uint8_t*>(map.nodes().data()), map.nodes().size_bytes());
  const std::span<const std::uint8_t> words(
      reinterpret_cast<const std::uint8_t*>(map.words().data()), map.words().size_bytes());
  const Split by_nodes(nodes.size(), kNodeItem, largest_buffer);
  const Split by_words(words.size() + kBeyond, kWordItem, largest_buffer);
  if (by_nodes.parts > kNodeParts || by_words.parts > kWordParts ||
      map.intensity_codes().size_bytes() + 4 > largest_buffer) {
    throw GpuError(
        fmt::format(
            "the map is larger than {} buffers of {} may be", kWordParts, device.info().name),
        VK_ERROR_OUT_OF_DEVICE_MEMORY);
  }
  device::MapNumbers numbers = numbers_of(map);
  numbers.node_shift = by_nodes.shift;
  numbers.word_shift = by_words.shift;
  DeviceUpload upload(device);
  numbers_ = upload.made_of(&numbers, sizeof numbers, 0);
  nodes_ = uploaded(upload, nodes, 0, by_nodes);
  words_ = uploaded(upload, words, kBeyond, by_words);
  codes_ = upload.made_of(map.intensity_codes().data(), map.intensity_codes().size_bytes(), 4);
}

}  // namespace pointflight
