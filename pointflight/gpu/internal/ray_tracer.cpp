#include "pointflight/gpu/internal/ray_tracer.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>

#include "pointflight/gpu/internal/device_commands.hpp"

namespace pointflight {
namespace {

constexpr std::uint32_t kResident = 2048;  // groups of a persistent kernel: more find nothing
constexpr std::uint64_t kLongest = 20'000'000'000;         // ns that a device may take for a slot
constexpr std::uint32_t kEnoughToTell = 1u << 17;          // rays, how fast a device is
constexpr std::uint64_t kFewest = std::uint64_t{1} << 18;  // bytes of a buffer

}  // namespace

RayTracer::RayTracer(GpuDevice& device, const DeviceMap& map, const RayKernel& kernel)
    : device_(device), map_(map), kernel_(kernel), pipelines_(device, kernel, map.is_split()) {
  try {
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
  device_.wait_until_idle();
  for (Slot& slot : slots_) vk.DestroyFence(handle, slot.fence, nullptr);
  vk.DestroyQueryPool(handle, queries_, nullptr);
  vk.DestroyCommandPool(handle, pool_, nullptr);
  vk.DestroyDescriptorPool(handle, descriptors_, nullptr);
}

void RayTracer::make_slots() {
  const VulkanFunctions& vk = device_.vk();
  VkDevice handle = device_.handle();
  constexpr auto kCount = static_cast<std::uint32_t>(kSlots);
  const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
                                  pipelines_.layout().bindings() * kCount};
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
    const VkDescriptorSetLayout layout = pipelines_.layout().set_layout();
    set.pSetLayouts = &layout;
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
  grow(slot.upload, needs.given + needs.tables + needs.beams, Use::kUpload);
  grow(slot.given, needs.given, Use::kDevice);
  grow(slot.tables, needs.tables, Use::kDevice);
  grow(slot.results, needs.results, Use::kDevice);
  grow(slot.more, needs.more, Use::kDevice);
  grow(slot.read_back, needs.results + needs.more, Use::kReadBack);
  if (slot.beams.bytes() < std::max<std::uint64_t>(needs.beams, 1)) slot.has_beams.reset();
  grow(slot.beams, needs.beams, Use::kDevice);
  if (lists_.bytes() < std::max<std::uint64_t>(needs.lists, 1)) {
    device_.wait_until_idle();  // others have the old one on their way
    grow(lists_, needs.lists, Use::kDevice);
    for (Slot& other : slots_) {
      if (other.given.bytes() > 0) bind(other);
    }
  }
  if (has_grown) bind(slot);
}

void RayTracer::bind(Slot& slot) {
  std::array<VkBuffer, kAllBindings> buffers{};
  buffers[kMapNumbers] = map_.numbers().handle();
  // sections in fewer buffers than there may be repeat one, which nothing reads
  const auto part = [](const std::vector<GpuBuffer>& parts, std::size_t k) {
    return parts[k < parts.size() ? k : 0].handle();
  };
  buffers[kNodes] = part(map_.nodes(), 0);
  buffers[kWords] = part(map_.words(), 0);
  for (std::size_t k = 1; k < kNodeParts; ++k) buffers[kMoreNodes + k - 1] = part(map_.nodes(), k);
  for (std::size_t k = 1; k < kWordParts; ++k) buffers[kMoreWords + k - 1] = part(map_.words(), k);
  buffers[kGiven] = slot.given.handle();
  buffers[kResults] = slot.results.handle();
  buffers[kBeams] = slot.beams.handle();
  buffers[kTables] = slot.tables.handle();
  buffers[kCodes] = map_.codes().handle();
  buffers[kLists] = lists_.handle();
  buffers[kMore] = slot.more.handle();
  std::array<VkDescriptorBufferInfo, kAllBindings> infos{};
  for (std::size_t i = 0; i < infos.size(); ++i) infos[i] = {buffers[i], 0, VK_WHOLE_SIZE};
  const auto number = static_cast<std::uint64_t>(&slot - slots_.data());
  infos[kCounter] = {counter_.handle(), 256 * number, 256};  // offsets of 256 suit all devices
  bind_buffers(device_, slot.set, std::span(infos).first(pipelines_.layout().bindings()));
}

std::span<MapRay> RayTracer::rays(std::size_t slot, std::size_t count) {
  make_room(slots_[slot],
            {.given = count * sizeof(MapRay), .results = count * sizeof(device::DeviceHit)});
  return slots_[slot].upload.as<MapRay>(count);
}

void RayTracer::submit(std::size_t slot, std::size_t count) {
  slots_[slot].call = {};
  slots_[slot].call.count = static_cast<std::uint32_t>(count);
  send(slots_[slot],
       {.given = count * sizeof(MapRay), .results = count * sizeof(device::DeviceHit)});
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

void RayTracer::send(Slot& slot, const Needs& needs) {
  slot.used = ++calls_;
  slot.sent = needs;
  record(slot);
  device_.submit(slot.commands, slot.fence);
}

void RayTracer::record(Slot& slot) {
  const VulkanFunctions& vk = device_.vk();
  const Needs& sent = slot.sent;
  const auto number = static_cast<std::uint32_t>(&slot - slots_.data());
  VkCommandBufferBeginInfo begin{};
  begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  require_success(vk.BeginCommandBuffer(slot.commands, &begin), "rays");
  const auto copy = [&](const GpuBuffer& from,
                        std::uint64_t at,
                        const GpuBuffer& to,
                        std::uint64_t bytes,
                        std::uint64_t into) {
    if (bytes == 0) return;
    const VkBufferCopy region{at, into, bytes};
    vk.CmdCopyBuffer(slot.commands, from.handle(), to.handle(), 1, &region);
  };
  copy(slot.upload, 0, slot.given, sent.given, 0);
  copy(slot.upload, sent.given, slot.tables, sent.tables, 0);
  copy(slot.upload, sent.given + sent.tables, slot.beams, sent.beams, 0);
  vk.CmdFillBuffer(slot.commands, counter_.handle(), 256 * std::uint64_t{number}, 4, 0);
  // what a kernel does not come to write is the processor's
  if (slot.call.threads > 0) {
    vk.CmdFillBuffer(slot.commands, slot.results.handle(), 0, sent.results, device::kNowhere);
  }
  vk.CmdResetQueryPool(slot.commands, queries_, 2 * number, 2);
  record_barrier(vk, slot.commands);
  const bool is_wide = slot.call.threads > 0;
  vk.CmdBindPipeline(slot.commands,
                     VK_PIPELINE_BIND_POINT_COMPUTE,
                     is_wide ? pipelines_.wide() : pipelines_.rays());
  vk.CmdBindDescriptorSets(slot.commands,
                           VK_PIPELINE_BIND_POINT_COMPUTE,
                           pipelines_.layout().handle(),
                           0,
                           1,
                           &slot.set,
                           0,
                           nullptr);
  vk.CmdWriteTimestamp(slot.commands, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, queries_, 2 * number);
  if (is_wide) {
    dispatch_wide(slot);
  } else {
    const std::uint32_t all = (slot.call.count + kGroupSize - 1) / kGroupSize;
    dispatch(slot, slot.call, kernel_.is_persistent ? std::min(all, kResident) : all);
  }
  vk.CmdWriteTimestamp(
      slot.commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, queries_, 2 * number + 1);
  record_barrier(vk, slot.commands);
  copy(slot.results, 0, slot.read_back, sent.results, 0);
  copy(slot.more, 0, slot.read_back, sent.more, sent.results);
  record_barrier(vk, slot.commands);
  require_success(vk.EndCommandBuffer(slot.commands), "rays");
}

void RayTracer::dispatch(const Slot& slot,
                         const device::DeviceCall& call,
                         std::uint32_t groups) const {
  const VulkanFunctions& vk = device_.vk();
  vk.CmdPushConstants(slot.commands,
                      pipelines_.layout().handle(),
                      VK_SHADER_STAGE_COMPUTE_BIT,
                      0,
                      sizeof call,
                      &call);
  vk.CmdDispatch(slot.commands, groups, 1, 1);
}

/// Devices take beam after beam in each invocation; processors, whose loops must be short, one in
/// each of several dispatches.
void RayTracer::dispatch_wide(const Slot& slot) const {
  device::DeviceCall call = slot.call;
  const std::uint32_t step = device_.info().is_processor ? call.threads : call.count;
  for (call.first = 0; call.first < call.count; call.first += step) {
    call.until = std::min(call.count, call.first + step);
    if (call.first > 0) record_barrier(device_.vk(), slot.commands);  // they share lists
    dispatch(slot, call, call.threads / kGroupSize);
  }
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
  const bool tells = slot.call.threads == 0 && slot.call.count >= kEnoughToTell;
  if (known != VK_SUCCESS || !tells || !(kernel_time_ > 0.0)) return;
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
