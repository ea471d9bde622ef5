#include "pointflight/gpu/internal/ray_tracer.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>

namespace pointflight::device {
// SPIR-V of kernel/rays.comp: PERSISTENT, EXACT_BY
#include "pointflight/gpu/kernels/rays_0_0.inc"
#include "pointflight/gpu/kernels/rays_0_1.inc"
#include "pointflight/gpu/kernels/rays_0_2.inc"
#include "pointflight/gpu/kernels/rays_1_0.inc"
#include "pointflight/gpu/kernels/rays_1_1.inc"
#include "pointflight/gpu/kernels/rays_1_2.inc"
}  // namespace pointflight::device

namespace pointflight {
namespace {

constexpr std::uint32_t kGroup = 128;      // invocations, as in the kernel
constexpr std::uint32_t kResident = 2048;  // groups of a persistent kernel: more find nothing
constexpr std::uint32_t kBindings = 7;     // of the kernel
constexpr std::uint64_t kLongest = 20'000'000'000;         // ns that a device may take for a slot
constexpr std::uint32_t kEnoughToTell = 1u << 17;          // rays, how fast a device is
constexpr std::uint64_t kFewest = std::uint64_t{1} << 18;  // bytes of a buffer

static_assert(sizeof(MapRay) == sizeof(device::DeviceRay));
static_assert(sizeof(SensorBeam) == sizeof(device::DeviceBeam));
static_assert(sizeof(BeamPose) == 4 * device::kPoseWords);
static_assert(sizeof(device::DeviceAim) == 4 * device::kAimWords);

using Code = std::span<const std::uint32_t>;

Code code_of(const RayKernel& kernel) {
  const Code plain[3] = {device::rays_0_0, device::rays_0_1, device::rays_0_2};
  const Code persistent[3] = {device::rays_1_0, device::rays_1_1, device::rays_1_2};
  const auto exact = static_cast<std::size_t>(kernel.exact);
  return kernel.is_persistent ? persistent[exact] : plain[exact];
}

void record_barrier(const VulkanFunctions& vk, VkCommandBuffer commands) {
  VkMemoryBarrier barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  barrier.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT |
                          VK_ACCESS_TRANSFER_READ_BIT | VK_ACCESS_HOST_READ_BIT;
  constexpr VkPipelineStageFlags kStages =
      VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
  vk.CmdPipelineBarrier(commands,
                        kStages,
                        kStages | VK_PIPELINE_STAGE_HOST_BIT,
                        0,
                        1,
                        &barrier,
                        0,
                        nullptr,
                        0,
                        nullptr);
}

}  // namespace

std::string name_of(const RayKernel& kernel) {
  const char* const names[3] = {"the device's own division", "fused multiply-add", "doubles"};
  return names[static_cast<std::size_t>(kernel.exact)];
}

std::vector<RayKernel> kernels_for(const GpuDevice& device) {
  const bool persistent = device.has_ballots() && !device.info().is_processor;
  std::vector<RayKernel> kernels{{ExactBy::kResiduals, persistent, 0}};
  if (device.info().has_doubles) kernels.push_back({ExactBy::kDoubles, persistent, 0});
  kernels.push_back({ExactBy::kDevice, persistent, 0});
  return kernels;
}

RayTracer::RayTracer(GpuDevice& device, const DeviceMap& map, const RayKernel& kernel)
    : device_(device), map_(map), kernel_(kernel) {
  try {
    make_pipeline(kernel);
    make_slots();
  } catch (const GpuError&) {
    release();
    throw;
  }
}

RayTracer::~RayTracer() {
  release();
}

void RayTracer::release() noexcept {
  const VulkanFunctions& vk = device_.vk();
  VkDevice handle = device_.handle();
  vk.DeviceWaitIdle(handle);
  for (Slot& slot : slots_) vk.DestroyFence(handle, slot.fence, nullptr);
  vk.DestroyQueryPool(handle, queries_, nullptr);
  vk.DestroyCommandPool(handle, pool_, nullptr);
  vk.DestroyDescriptorPool(handle, descriptors_, nullptr);
  vk.DestroyPipeline(handle, pipeline_, nullptr);
  vk.DestroyPipelineLayout(handle, layout_, nullptr);
  vk.DestroyDescriptorSetLayout(handle, set_layout_, nullptr);
}

void RayTracer::make_pipeline(const RayKernel& kernel) {
  const VulkanFunctions& vk = device_.vk();
  VkDevice handle = device_.handle();
  std::array<VkDescriptorSetLayoutBinding, kBindings> bindings{};
  for (std::uint32_t i = 0; i < kBindings; ++i) {
    bindings[i].binding = i;
    bindings[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    bindings[i].descriptorCount = 1;
    bindings[i].stageFlags = VK_SHADER_STAGE_COMPUTE_BIT;
  }
  VkDescriptorSetLayoutCreateInfo set{};
  set.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  set.bindingCount = kBindings;
  set.pBindings = bindings.data();
  require_success(vk.CreateDescriptorSetLayout(handle, &set, nullptr, &set_layout_), "kernel");
  const VkPushConstantRange call{VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(device::DeviceCall)};
  VkPipelineLayoutCreateInfo layout{};
  layout.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  layout.setLayoutCount = 1;
  layout.pSetLayouts = &set_layout_;
  layout.pushConstantRangeCount = 1;
  layout.pPushConstantRanges = &call;
  require_success(vk.CreatePipelineLayout(handle, &layout, nullptr, &layout_), "kernel");

  const Code code = code_of(kernel);
  VkShaderModuleCreateInfo module{};
  module.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  module.codeSize = code.size_bytes();
  module.pCode = code.data();
  VkShaderModule shader = VK_NULL_HANDLE;
  require_success(vk.CreateShaderModule(handle, &module, nullptr, &shader), "kernel");
  const VkSpecializationMapEntry entry{0, 0, sizeof kernel.most_chunks};
  const VkSpecializationInfo constants{1, &entry, sizeof kernel.most_chunks, &kernel.most_chunks};
  VkComputePipelineCreateInfo pipeline{};
  pipeline.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
  pipeline.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  pipeline.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  pipeline.stage.module = shader;
  pipeline.stage.pName = "main";
  pipeline.stage.pSpecializationInfo = &constants;
  pipeline.layout = layout_;
  const VkResult made =
      vk.CreateComputePipelines(handle, VK_NULL_HANDLE, 1, &pipeline, nullptr, &pipeline_);
  vk.DestroyShaderModule(handle, shader, nullptr);
  require_success(made, "kernel");
}

void RayTracer::make_slots() {
  const VulkanFunctions& vk = device_.vk();
  VkDevice handle = device_.handle();
  constexpr auto kCount = static_cast<std::uint32_t>(kSlots);
  const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, kBindings * kCount};
  VkDescriptorPoolCreateInfo descriptors{};
  descriptors.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
  descriptors.maxSets = kCount;
  descriptors.poolSizeCount = 1;
  descriptors.pPoolSizes = &size;
  require_success(vk.CreateDescriptorPool(handle, &descriptors, nullptr, &descriptors_), "slots");
  VkCommandPoolCreateInfo pool{};
  pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
  pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
  pool.queueFamilyIndex = device_.queue_family();
  require_success(vk.CreateCommandPool(handle, &pool, nullptr, &pool_), "slots");
  VkQueryPoolCreateInfo queries{};
  queries.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO;
  queries.queryType = VK_QUERY_TYPE_TIMESTAMP;
  queries.queryCount = 2 * kCount;
  require_success(vk.CreateQueryPool(handle, &queries, nullptr, &queries_), "slots");
  counter_ = GpuBuffer(device_, 4 * kSlots * 64, GpuBuffer::Use::kDevice);
  for (Slot& slot : slots_) {
    VkDescriptorSetAllocateInfo set{};
    set.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
    set.descriptorPool = descriptors_;
    set.descriptorSetCount = 1;
    set.pSetLayouts = &set_layout_;
    require_success(vk.AllocateDescriptorSets(handle, &set, &slot.set), "slots");
    VkCommandBufferAllocateInfo commands{};
    commands.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    commands.commandPool = pool_;
    commands.commandBufferCount = 1;
    require_success(vk.AllocateCommandBuffers(handle, &commands, &slot.commands), "slots");
    VkFenceCreateInfo fence{};
    fence.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
    require_success(vk.CreateFence(handle, &fence, nullptr, &slot.fence), "slots");
  }
}

/// Buffers grow to what is asked for: twice as much at least.
void RayTracer::make_room(Slot& slot, const Needs& needs) {
  using Use = GpuBuffer::Use;
  bool has_grown = false;
  const auto grow = [&](GpuBuffer& buffer, std::uint64_t bytes, Use use) {
    if (buffer.bytes() >= bytes && buffer.bytes() > 0) return;
    const std::uint64_t most = device_.info().largest_buffer;
    const std::uint64_t room = std::min(most, std::max({bytes, 2 * buffer.bytes(), kFewest}));
    buffer = GpuBuffer(device_, std::max(room, bytes), use);
    has_grown = true;
  };
  grow(slot.upload, needs.given + needs.beams, Use::kUpload);
  grow(slot.given, needs.given, Use::kDevice);
  grow(slot.results, needs.results, Use::kDevice);
  grow(slot.read_back, needs.results, Use::kReadBack);
  if (slot.beams.bytes() < std::max<std::uint64_t>(needs.beams, 1)) slot.has_beams.reset();
  grow(slot.beams, needs.beams, Use::kDevice);
  if (has_grown) bind(slot);
}

void RayTracer::bind(Slot& slot) {
  const std::array<VkBuffer, kBindings> buffers = {map_.buffers()[0].handle(),
                                                   map_.buffers()[1].handle(),
                                                   map_.buffers()[2].handle(),
                                                   slot.given.handle(),
                                                   slot.results.handle(),
                                                   counter_.handle(),
                                                   slot.beams.handle()};
  std::array<VkDescriptorBufferInfo, kBindings> infos{};
  std::array<VkWriteDescriptorSet, kBindings> writes{};
  const auto number = static_cast<std::uint64_t>(&slot - slots_.data());
  for (std::uint32_t i = 0; i < kBindings; ++i) {
    infos[i] = {buffers[i], 0, VK_WHOLE_SIZE};
    // offsets of 256 suit all devices
    if (buffers[i] == counter_.handle()) infos[i] = {buffers[i], 256 * number, 256};
    writes[i].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    writes[i].dstSet = slot.set;
    writes[i].dstBinding = i;
    writes[i].descriptorCount = 1;
    writes[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    writes[i].pBufferInfo = &infos[i];
  }
  device_.vk().UpdateDescriptorSets(device_.handle(), kBindings, writes.data(), 0, nullptr);
}

std::span<MapRay> RayTracer::rays(std::size_t slot, std::size_t count) {
  make_room(slots_[slot], {count * sizeof(MapRay), 0, count * sizeof(device::DeviceHit)});
  return slots_[slot].upload.as<MapRay>(count);
}

void RayTracer::submit(std::size_t slot, std::size_t count) {
  slots_[slot].call = {static_cast<std::uint32_t>(count), 0, 0, 0};
  send(slots_[slot], count * sizeof(MapRay), 0);
}

void RayTracer::submit(std::size_t number, const KernelMap& map, const AimedPart& part) {
  Slot& slot = slots_[number];
  const std::size_t count = part.beams->beams.size();
  const std::size_t rays = count * part.aims.size();
  std::size_t words = part.aims.size() * device::kAimWords;
  for (const AimedBeams* aim : part.aims) {
    words += aim->poses.size() * device::kPoseWords + 2 * aim->deviations.size();
  }
  const std::uint64_t table = count * sizeof(SensorBeam);
  const std::uint64_t per_ray = part.wants_ranges ? sizeof(float) : sizeof(device::DeviceHit);
  make_room(slot, {4 * words, table, rays * per_ray});
  auto* const given = slot.upload.as<std::uint32_t>(words).data();
  auto* const aims = reinterpret_cast<device::DeviceAim*>(given);
  std::size_t at = part.aims.size() * device::kAimWords;
  const auto append = [&](const auto& all) {
    const std::size_t begin = at;
    std::memcpy(given + at, all.data(), all.size() * sizeof all[0]);
    at += all.size() * sizeof all[0] / 4;
    return static_cast<std::uint32_t>(begin);
  };
  for (std::size_t i = 0; i < part.aims.size(); ++i) {
    const AimedBeams& aim = *part.aims[i];
    const MapPosition from = map_position(map, aim);
    const std::uint32_t poses = append(aim.poses);
    const bool is_rolling = aim.poses.size() > 1;
    aims[i] = {from.axis[0].voxel,
               from.axis[1].voxel,
               from.axis[2].voxel,
               from.axis[0].rest,
               from.axis[1].rest,
               from.axis[2].rest,
               aim.range_max,
               poses,
               is_rolling ? 1u : 0u,
               aim.deviations.empty() ? device::kNowhere : append(aim.deviations)};
  }
  const bool brings_beams = slot.has_beams != part.beams;
  if (brings_beams) {
    const std::span all(part.beams->beams);
    auto* const beams = reinterpret_cast<SensorBeam*>(given + words);
    const bool has_order = part.beams->order.size() == count;
    for (std::size_t i = 0; i < count; ++i) beams[i] = all[has_order ? part.beams->order[i] : i];
    slot.has_beams = part.beams;
  }
  slot.call = {static_cast<std::uint32_t>(rays),
               static_cast<std::uint32_t>(count),
               part.beams->has_origins ? 1u : 0u,
               part.wants_ranges ? 1u : 0u};
  send(slot, 4 * words, brings_beams ? table : 0);
}

std::size_t RayTracer::slot_for(const SensorBeams* beams,
                                const std::function<bool(std::size_t)>& is_free) const {
  std::size_t best = kSlots;
  for (std::size_t i = 0; i < kSlots; ++i) {
    if (!is_free(i)) continue;
    if (beams != nullptr && slots_[i].has_beams.get() == beams) return i;
    if (best == kSlots || slots_[i].used < slots_[best].used) best = i;
  }
  return best;
}

void RayTracer::send(Slot& slot, std::uint64_t given, std::uint64_t beams) {
  slot.used = ++calls_;
  record(slot, given, beams);
  device_.submit(slot.commands, slot.fence);
}

/// Of the upload buffer `given` bytes are copied, and behind them `beams`.
void RayTracer::record(Slot& slot, std::uint64_t given, std::uint64_t beams) {
  const VulkanFunctions& vk = device_.vk();
  const auto number = static_cast<std::uint32_t>(&slot - slots_.data());
  VkCommandBufferBeginInfo begin{};
  begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  require_success(vk.BeginCommandBuffer(slot.commands, &begin), "rays");
  const VkBufferCopy up{0, 0, given};
  vk.CmdCopyBuffer(slot.commands, slot.upload.handle(), slot.given.handle(), 1, &up);
  const VkBufferCopy table{given, 0, beams};
  if (beams > 0) {
    vk.CmdCopyBuffer(slot.commands, slot.upload.handle(), slot.beams.handle(), 1, &table);
  }
  vk.CmdFillBuffer(slot.commands, counter_.handle(), 256 * std::uint64_t{number}, 4, 0);
  vk.CmdResetQueryPool(slot.commands, queries_, 2 * number, 2);
  record_barrier(vk, slot.commands);
  vk.CmdBindPipeline(slot.commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_);
  vk.CmdBindDescriptorSets(
      slot.commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout_, 0, 1, &slot.set, 0, nullptr);
  vk.CmdPushConstants(
      slot.commands, layout_, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof slot.call, &slot.call);
  vk.CmdWriteTimestamp(slot.commands, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, queries_, 2 * number);
  const std::uint32_t all = (slot.call.count + kGroup - 1) / kGroup;
  vk.CmdDispatch(slot.commands, kernel_.is_persistent ? std::min(all, kResident) : all, 1, 1);
  vk.CmdWriteTimestamp(
      slot.commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, queries_, 2 * number + 1);
  record_barrier(vk, slot.commands);
  const std::uint64_t per_ray =
      slot.call.wants_ranges != 0 ? sizeof(float) : sizeof(device::DeviceHit);
  const VkBufferCopy down{0, 0, slot.call.count * per_ray};
  vk.CmdCopyBuffer(slot.commands, slot.results.handle(), slot.read_back.handle(), 1, &down);
  record_barrier(vk, slot.commands);
  require_success(vk.EndCommandBuffer(slot.commands), "rays");
}

void RayTracer::wait(std::size_t number) {
  const VulkanFunctions& vk = device_.vk();
  VkDevice handle = device_.handle();
  Slot& slot = slots_[number];
  const char* name = device_.info().name.c_str();
  require_success(vk.WaitForFences(handle, 1, &slot.fence, VK_TRUE, kLongest), name);
  require_success(vk.ResetFences(handle, 1, &slot.fence), name);
  std::array<std::uint64_t, 2> ticks{};
  const VkResult known = vk.GetQueryPoolResults(handle,
                                                queries_,
                                                static_cast<std::uint32_t>(2 * number),
                                                2,
                                                sizeof ticks,
                                                ticks.data(),
                                                sizeof ticks[0],
                                                VK_QUERY_RESULT_64_BIT);
  if (known == VK_SUCCESS) {
    kernel_time_ = 1e-9 * device_.tick() * static_cast<double>(ticks[1] - ticks[0]);
  }
  if (known != VK_SUCCESS || slot.call.count < kEnoughToTell || !(kernel_time_ > 0.0)) return;
  constexpr double kBest = 0.1;  // s: desktops want the device back, and hosts something to do
  const double best = kBest * static_cast<double>(slot.call.count) / kernel_time_;
  beams_at_once_ = static_cast<std::size_t>(
      std::clamp(best, static_cast<double>(kEnoughToTell), static_cast<double>(kMostBeams)));
}

std::span<const device::DeviceHit> RayTracer::hits(std::size_t slot) const {
  return slots_[slot].read_back.as<const device::DeviceHit>(slots_[slot].call.count);
}

std::span<const float> RayTracer::ranges(std::size_t slot) const {
  return slots_[slot].read_back.as<const float>(slots_[slot].call.count);
}

}  // namespace pointflight
