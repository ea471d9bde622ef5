#include "pointflight/gpu/internal/device_painter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <limits>
#include <mutex>
#include <utility>
#include <vector>

#include "pointflight/gpu/internal/device_layout.hpp"
#include "pointflight/gpu/internal/device_upload.hpp"
#include "pointflight/gpu/internal/kernel_layout.hpp"

namespace pointflight::device {
// SPIR-V of kernel/paper.comp: EXACT_BY
#include "pointflight/gpu/kernels/paper_0.inc"
#include "pointflight/gpu/kernels/paper_1.inc"
#include "pointflight/gpu/kernels/paper_2.inc"
}  // namespace pointflight::device

namespace pointflight {
namespace {

constexpr std::uint64_t kLongest = 20'000'000'000;  // ns that a device may take for an image
constexpr std::uint64_t kMostLarge = 1u << 18;      // points of many pixels
constexpr std::uint32_t kGroupsAlong = 32768;       // of a dispatch's x; devices take 65,535
constexpr std::uint32_t kEmptyDepth = 0x7f800000u;  // infinity

/// What the kernel's buffers are bound to.
enum PaperBinding : std::uint32_t {
  kImage,
  kPoints,
  kChunks,
  kAngles,
  kDepths,
  kOwners,
  kLarge,
  kPlanes,
  kPaperBindings
};

/// A kernel and a set of buffers for it.
class PaperKernel {
 public:
  PaperKernel(GpuDevice& device, ExactBy exact)
      : device_(device), layout_(device, kPaperBindings, sizeof(device::PaperCall)) {
    const std::span<const std::uint32_t> all[3] = {
        device::paper_0, device::paper_1, device::paper_2};
    kernel_ = layout_.kernel_of(all[static_cast<std::size_t>(exact)], 0);
    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, kPaperBindings};
    VkDescriptorPoolCreateInfo pool{};
    pool.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
    pool.maxSets = 1;
    pool.poolSizeCount = 1;
    pool.pPoolSizes = &size;
    const VulkanFunctions& vk = device.vk();
    VkDescriptorSetAllocateInfo set{};
    set.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
    set.descriptorSetCount = 1;
    const VkDescriptorSetLayout layout = layout_.set_layout();
    set.pSetLayouts = &layout;
    VkResult made = vk.CreateDescriptorPool(device.handle(), &pool, nullptr, &pool_);
    set.descriptorPool = pool_;
    if (made == VK_SUCCESS) made = vk.AllocateDescriptorSets(device.handle(), &set, &set_);
    if (made == VK_SUCCESS) return;
    release();
    throw GpuError("kernel", made);
  }
  ~PaperKernel() { release(); }
  PaperKernel(const PaperKernel&) = delete;
  PaperKernel& operator=(const PaperKernel&) = delete;

  void bind(const std::array<const GpuBuffer*, kPaperBindings>& buffers) const {
    std::array<VkDescriptorBufferInfo, kPaperBindings> infos{};
    for (std::size_t i = 0; i < infos.size(); ++i)
      infos[i] = {buffers[i]->handle(), 0, VK_WHOLE_SIZE};
    bind_buffers(device_, set_, infos);
  }

  void record_start(VkCommandBuffer commands) const {
    const VulkanFunctions& vk = device_.vk();
    vk.CmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, kernel_);
    vk.CmdBindDescriptorSets(
        commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout_.handle(), 0, 1, &set_, 0, nullptr);
  }
  void record(VkCommandBuffer commands, const device::PaperCall& call, std::uint64_t groups) const {
    const VulkanFunctions& vk = device_.vk();
    const auto along = static_cast<std::uint32_t>(std::min<std::uint64_t>(groups, kGroupsAlong));
    const auto up = static_cast<std::uint32_t>((groups + kGroupsAlong - 1) / kGroupsAlong);
    vk.CmdPushConstants(
        commands, layout_.handle(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof call, &call);
    vk.CmdDispatch(commands, along, up, 1);
  }

 private:
  void release() noexcept {
    device_.vk().DestroyPipeline(device_.handle(), kernel_, nullptr);
    device_.vk().DestroyDescriptorPool(device_.handle(), pool_, nullptr);
  }

  GpuDevice& device_;
  KernelLayout layout_;
  VkPipeline kernel_ = VK_NULL_HANDLE;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
  VkDescriptorSet set_ = VK_NULL_HANDLE;
};

device::PaperNumbers numbers_of(const PaperImage& image, const Matrix3f& turn) {
  device::PaperNumbers n{};
  n.rows = static_cast<std::uint32_t>(image.rows);
  n.columns = static_cast<std::uint32_t>(image.columns);
  n.is_full_turn = image.full_turn ? 1 : 0;
  n.is_narrow = image.narrow ? 1 : 0;
  n.step = image.step;
  n.column_step = image.column_step;
  n.azimuth_min = image.azimuth_min;
  n.elevation_min = image.elevation_min;
  n.range_max = image.range_max;
  n.sin_low = image.sin_low;
  n.sin_high = image.sin_high;
  n.left_x = image.left[0];
  n.left_y = image.left[1];
  n.right_x = image.right[0];
  n.right_y = image.right[1];
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) n.turn[3 * row + column] = turn(row, column);
  }
  return n;
}

/// Cosines and sines of rows, then of columns.
std::vector<float> angles_of(const PaperImage& image) {
  std::vector<float> angles;
  const auto add =
      [&](const std::vector<float>& cosines, const std::vector<float>& sines, int count) {
        for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
          angles.push_back(cosines[i]);
          angles.push_back(sines[i]);
        }
      };
  add(image.row_cos, image.row_sin, image.rows);
  add(image.column_cos, image.column_sin, image.columns);
  return angles;
}

class DevicePainter : public PaperPainter {
 public:
  DevicePainter(ExactGpu gpu, std::span<const PaperVoxel> voxels)
      : voxels_(voxels),
        instead_(make_processor_painter(voxels)),
        device_(std::move(gpu.device)),
        kernel_(*device_, gpu.kernel.exact),
        commands_(*device_) {
    upload_points();
    large_ = GpuBuffer(*device_, 8 + 8 * kMostLarge, GpuBuffer::Use::kDevice);
    image_ = GpuBuffer(*device_, 256, GpuBuffer::Use::kUpload);
  }
  ~DevicePainter() override { device_->wait_until_idle(); }
  DevicePainter(const DevicePainter&) = delete;
  DevicePainter& operator=(const DevicePainter&) = delete;

  void draw(std::span<const std::size_t> seen,
            const Pose& T_sensor_world,
            PaperImage& image,
            const Executor& executor) const override {
    if (seen.empty()) return;
    try {
      if (!is_lost_) {
        if (draw_on_device(seen, T_sensor_world, image)) return;
        if (!has_said_.exchange(true)) {
          add_gpu_notice(
              "gpu-paper: too many points close to the sensor; the processor paints such images, "
              "to the same bits");
        }
      }
    } catch (const GpuError& error) {
      if (!is_lost_.exchange(true)) {
        add_gpu_notice(
            fmt::format("{}: from here on the processor renders, to the same bits", error.what()));
      }
    }
    instead_->draw(seen, T_sensor_world, image, executor);
  }

 private:
  void upload_points();
  /// False if there is more than the device has room for; then the image is as it was.
  bool draw_on_device(std::span<const std::size_t> seen,
                      const Pose& T_sensor_world,
                      PaperImage& image) const;
  void make_room(std::uint64_t chunks, std::uint64_t angles, std::uint64_t pixels) const;
  void record(VkCommandBuffer commands, std::uint32_t chunks, std::uint64_t pixels) const;
  void take(PaperImage& image, std::uint64_t pixels) const;

  std::span<const PaperVoxel> voxels_;
  std::unique_ptr<PaperPainter> instead_;
  std::vector<std::uint32_t> first_point_;  ///< By voxel.
  std::shared_ptr<GpuDevice> device_;
  PaperKernel kernel_;
  mutable DeviceCommands commands_;
  GpuBuffer points_, large_, image_;
  mutable std::mutex mutex_;  ///< Of what is below and of the commands: an image at a time.
  mutable GpuBuffer chunks_, angles_, depths_, owners_, planes_, read_back_;
  mutable std::atomic<bool> is_lost_ = false;
  mutable std::atomic<bool> has_said_ = false;  ///< That there was too much for the device.
};

void DevicePainter::upload_points() {
  std::vector<device::PaperPoint> points;
  for (const PaperVoxel& voxel : voxels_) {
    first_point_.push_back(static_cast<std::uint32_t>(points.size()));
    const PaperPoints& own = voxel.points;
    for (std::size_t i = 0; i < own.count; ++i) {
      points.push_back({own.x[i],
                        own.y[i],
                        own.z[i],
                        own.planar[i] > 0.5f ? -own.radius[i] : own.radius[i],
                        own.nx[i],
                        own.ny[i],
                        own.nz[i],
                        own.intensity[i]});
    }
  }
  const std::uint64_t bytes = points.size() * sizeof(device::PaperPoint);
  if (bytes > device_->info().largest_buffer || points.size() >= 1u << 31) {
    throw GpuError("the map's points are more than a buffer of " + device_->info().name + " holds",
                   VK_ERROR_OUT_OF_DEVICE_MEMORY);
  }
  points_ = DeviceUpload(*device_).made_of(points.data(), bytes, 0);
}

/// Buffers grow to what is asked for.
void DevicePainter::make_room(std::uint64_t chunks,
                              std::uint64_t angles,
                              std::uint64_t pixels) const {
  using Use = GpuBuffer::Use;
  const auto grow = [&](GpuBuffer& buffer, std::uint64_t bytes, Use use) {
    if (buffer.bytes() < bytes) buffer = GpuBuffer(*device_, bytes + bytes / 4, use);
  };
  grow(chunks_, chunks, Use::kUpload);
  grow(angles_, angles, Use::kUpload);
  grow(depths_, 4 * pixels, Use::kDevice);
  grow(owners_, 4 * pixels, Use::kDevice);
  grow(planes_, 12 * pixels, Use::kDevice);
  grow(read_back_, 12 * pixels + 8, Use::kReadBack);
  kernel_.bind({&image_, &points_, &chunks_, &angles_, &depths_, &owners_, &large_, &planes_});
}

bool DevicePainter::draw_on_device(std::span<const std::size_t> seen,
                                   const Pose& T_sensor_world,
                                   PaperImage& image) const {
  std::vector<device::PaperChunk> chunks;
  for (const std::size_t v : seen) {
    const Vector3f corner = (T_sensor_world * voxels_[v].corner_world).cast<float>();
    const auto count = static_cast<std::uint32_t>(voxels_[v].points.count);
    for (std::uint32_t at = 0; at < count; at += device::kChunk) {
      chunks.push_back({first_point_[v] + at,
                        std::min(device::kChunk, count - at),
                        corner.x(),
                        corner.y(),
                        corner.z()});
    }
  }
  const std::vector<float> angles = angles_of(image);
  const device::PaperNumbers numbers =
      numbers_of(image, T_sensor_world.rotation.toRotationMatrix().cast<float>());
  const std::uint64_t pixels = std::uint64_t{numbers.rows} * numbers.columns;
  const std::lock_guard lock(mutex_);
  make_room(chunks.size() * sizeof chunks[0], angles.size() * sizeof angles[0], pixels);
  std::memcpy(image_.as<device::PaperNumbers>(1).data(), &numbers, sizeof numbers);
  std::copy(chunks.begin(), chunks.end(), chunks_.as<device::PaperChunk>(chunks.size()).begin());
  std::copy(angles.begin(), angles.end(), angles_.as<float>(angles.size()).begin());
  record(commands_.begin(), static_cast<std::uint32_t>(chunks.size()), pixels);
  commands_.run(kLongest);
  const auto large = read_back_.as<std::uint32_t>(3 * pixels + 2).subspan(3 * pixels);
  // points that found no room, or whose pixels a device did not come to
  if (large[0] > kMostLarge || large[1] != 2 * device::kChunk * large[0]) return false;
  take(image, pixels);
  return true;
}

void DevicePainter::record(VkCommandBuffer commands,
                           std::uint32_t chunks,
                           std::uint64_t pixels) const {
  const VulkanFunctions& vk = device_->vk();
  const auto fill = [&](const GpuBuffer& buffer, std::uint64_t bytes, std::uint32_t with) {
    vk.CmdFillBuffer(commands, buffer.handle(), 0, bytes, with);
  };
  fill(depths_, 4 * pixels, kEmptyDepth);
  fill(owners_, 4 * pixels, device::kNowhere);
  fill(planes_, 12 * pixels, kEmptyDepth);
  fill(large_, 8, 0);
  record_barrier(vk, commands);
  kernel_.record_start(commands);
  const auto task = [&](device::uint which, std::uint64_t groups) {
    kernel_.record(commands, {which, chunks}, groups);
    record_barrier(vk, commands);
  };
  task(device::kDrawDepths, chunks);
  task(device::kDrawLarge, device::kLargeGroups);
  task(device::kClaim, chunks);
  task(device::kClaimLarge, device::kLargeGroups);
  task(device::kResolve, (pixels + device::kChunk - 1) / device::kChunk);
  const VkBufferCopy all{0, 0, 12 * pixels};
  vk.CmdCopyBuffer(commands, planes_.handle(), read_back_.handle(), 1, &all);
  const VkBufferCopy counts{0, 12 * pixels, 8};
  vk.CmdCopyBuffer(commands, large_.handle(), read_back_.handle(), 1, &counts);
  record_barrier(vk, commands);
}

/// What was read back into the image, whose rows are longer.
void DevicePainter::take(PaperImage& image, std::uint64_t pixels) const {
  const auto columns = static_cast<std::size_t>(image.columns);
  const std::span<const float> planes = read_back_.as<const float>(3 * pixels);
  std::size_t plane = 0;
  for (std::vector<float>* to : {&image.depth, &image.cosine, &image.intensity}) {
    const std::span<const float> from = planes.subspan(pixels * plane++, pixels);
    for (std::size_t row = 0; row < static_cast<std::size_t>(image.rows); ++row) {
      const auto line = from.subspan(row * columns, columns);
      std::copy(
          line.begin(), line.end(), to->begin() + static_cast<std::ptrdiff_t>(row * image.stride));
    }
  }
}

}  // namespace

std::unique_ptr<PaperPainter> make_device_painter(ExactGpu gpu,
                                                  std::span<const PaperVoxel> voxels) {
  return std::make_unique<DevicePainter>(std::move(gpu), voxels);
}

}  // namespace pointflight
