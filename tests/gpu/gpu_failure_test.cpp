// Devices that fail: Vulkan's functions are exchanged for such as say so.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "pointflight/gpu/gpu_renderer.hpp"
#include "pointflight/gpu/internal/exact_gpu.hpp"
#include "pointflight/gpu/internal/kernel_choice.hpp"
#include "pointflight/gpu/internal/vulkan_functions.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "tests/gpu/device.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;

/// Calls that are still to be made as they should.
std::atomic<int> good_calls{0};
/// Vulkan's own; there may be none when the program starts.
const VulkanFunctions& kept() {
  static const VulkanFunctions own = VulkanFunctions::get();
  return own;
}

bool fails() {
  return good_calls-- <= 0;
}

VkResult submits(VkQueue queue, std::uint32_t count, const VkSubmitInfo* infos, VkFence fence) {
  return fails() ? VK_ERROR_DEVICE_LOST : kept().QueueSubmit(queue, count, infos, fence);
}
VkResult waits(VkDevice device,
               std::uint32_t count,
               const VkFence* fences,
               VkBool32 all,
               std::uint64_t timeout) {
  return fails() ? VK_TIMEOUT : kept().WaitForFences(device, count, fences, all, timeout);
}
VkResult allocates(VkDevice device,
                   const VkMemoryAllocateInfo* info,
                   const VkAllocationCallbacks* callbacks,
                   VkDeviceMemory* memory) {
  return fails() ? VK_ERROR_OUT_OF_DEVICE_MEMORY
                 : kept().AllocateMemory(device, info, callbacks, memory);
}
VkResult opens(VkPhysicalDevice /*device*/,
               const VkDeviceCreateInfo* /*info*/,
               const VkAllocationCallbacks* /*callbacks*/,
               VkDevice* /*made*/) {
  return VK_ERROR_INITIALIZATION_FAILED;
}

/// While it lives a function of Vulkan fails from the call after `good` on.
template <class Function>
class Failing {
 public:
  Failing(Function VulkanFunctions::*member, Function failing, int good) : member_(member) {
    good_calls = good;
    static_cast<void>(kept());
    functions().*member = failing;
  }
  ~Failing() { functions().*member_ = kept().*member_; }
  Failing(const Failing&) = delete;
  Failing& operator=(const Failing&) = delete;

 private:
  static VulkanFunctions& functions() {
    return const_cast<VulkanFunctions&>(VulkanFunctions::get());  // which is not const itself
  }
  Function VulkanFunctions::*member_;
};

/// Scans of 2,000 rays each, as jobs.
struct Jobs {
  explicit Jobs(std::size_t count) : aims(trial_aims(2000, count)), hits(count) {
    for (std::size_t k = 0; k < count; ++k) {
      hits[k].resize(2000);
      RenderJob job;
      job.batch.aimed = &aims.aims[k];
      job.hits = hits[k];
      all.push_back(job);
    }
  }
  TrialAims aims;
  std::vector<std::vector<Hit>> hits;
  std::vector<RenderJob> all;
};

void expect_those_of_beam(const Jobs& jobs) {
  Jobs expected(jobs.all.size());
  BeamRenderer(Scene{trial_scene()}).render(expected.all, Executor(2));
  for (std::size_t k = 0; k < jobs.hits.size(); ++k) {
    for (std::size_t i = 0; i < jobs.hits[k].size(); ++i) {
      ASSERT_EQ(jobs.hits[k][i].range, expected.hits[k][i].range);
      ASSERT_EQ(jobs.hits[k][i].surfel, expected.hits[k][i].surfel);
    }
  }
}

TEST(GpuFailures, ALostDeviceEndsInTheProcessorsResultAndASentence) {
  SKIP_WITHOUT_DEVICE();
  static_cast<void>(take_gpu_notices());
  const Executor executor(2);
  for (const int good : {0, 1}) {
    const auto renderer = make_gpu_renderer(Scene{trial_scene()});
    EXPECT_GT(renderer->jobs_at_once(), 0u);
    Jobs first(3);
    Jobs second(3);
    {
      const Failing failing(&VulkanFunctions::QueueSubmit, &submits, good);
      // two on their way
      const auto one = renderer->submit(first.all, executor);
      const auto other = renderer->submit(second.all, executor);
      other->collect();
      one->collect();
    }
    expect_those_of_beam(first);
    expect_those_of_beam(second);
    const auto notices = take_gpu_notices();
    ASSERT_EQ(notices.size(), 1u);
    expect_contains(notices[0], "the device is lost");
    expect_contains(notices[0], "the processor renders");
    // and so it stays
    EXPECT_EQ(renderer->jobs_at_once(), 0u);
    Jobs third(2);
    renderer->render(third.all, executor);
    expect_those_of_beam(third);
    EXPECT_TRUE(take_gpu_notices().empty());
  }
}

TEST(GpuFailures, ADeviceThatDoesNotAnswerIsGivenUp) {
  SKIP_WITHOUT_DEVICE();
  const auto renderer = make_gpu_renderer(Scene{trial_scene()});
  Jobs jobs(4);
  {
    const Failing failing(&VulkanFunctions::WaitForFences, &waits, 0);
    renderer->render(jobs.all, Executor(1));
  }
  expect_those_of_beam(jobs);
  const auto notices = take_gpu_notices();
  ASSERT_EQ(notices.size(), 1u);
  expect_contains(notices[0], "it does not answer");
}

TEST(GpuFailures, NoMemory) {
  SKIP_WITHOUT_DEVICE();
  {
    const Failing failing(&VulkanFunctions::AllocateMemory, &allocates, 0);
    const std::string error =
        error_of([] { static_cast<void>(make_gpu_renderer(Scene{trial_scene()})); });
    expect_contains(error, "out of memory; use --renderer beam");
    EXPECT_EQ(error.find('\n'), std::string::npos);
  }
  const auto renderer = make_gpu_renderer(Scene{trial_scene()});
  Jobs jobs(4);
  {
    const Failing failing(&VulkanFunctions::AllocateMemory, &allocates, 2);
    renderer->render(jobs.all, Executor(1));
  }
  expect_those_of_beam(jobs);
  ASSERT_EQ(take_gpu_notices().size(), 1u);
}

TEST(GpuFailures, ADeviceThatDoesNotOpen) {
  SKIP_WITHOUT_DEVICE();
  const Failing failing(&VulkanFunctions::CreateDevice, &opens, 0);
  expect_contains(error_of([] { static_cast<void>(make_gpu_renderer(Scene{trial_scene()})); }),
                  "use --renderer beam");
  // and `auto` goes on without: of processors it is not even asked
  Jobs jobs(1);
  make_automatic_renderer(Scene{trial_scene()})->render(jobs.all, Executor(1));
  expect_those_of_beam(jobs);
  static_cast<void>(take_gpu_notices());
}

void dispatches(VkCommandBuffer /*commands*/,
                std::uint32_t /*x*/,
                std::uint32_t /*y*/,
                std::uint32_t /*z*/) {}

TEST(GpuFailures, ADeviceWithOtherBitsIsRefusedUnlessTheyWillDo) {
  SKIP_WITHOUT_DEVICE();
  const auto device = GpuDevice::open(find_gpu(""));
  std::optional<RayKernel> found;
  {
    // one that computes nothing
    const Failing failing(&VulkanFunctions::CmdDispatch, &dispatches, 0);
    found = find_exact_kernel(*device);
  }
  EXPECT_FALSE(found.has_value());
  const std::string error =
      error_of([&] { static_cast<void>(kernel_for_use(*device, found, false)); });
  expect_contains(error, device->info().name);
  expect_contains(error, "--renderer beam, or --gpu approximate");
  static_cast<void>(take_gpu_notices());
  static_cast<void>(kernel_for_use(*device, found, true));
  const auto notices = take_gpu_notices();
  ASSERT_EQ(notices.size(), 1u);
  expect_contains(notices[0], "has not this processor's bits");
}

TEST(GpuFailures, ChoicesSayWhichOneAndWhetherItMayBeApproximate) {
  SKIP_WITHOUT_DEVICE();
  choose_gpu("0,approximate");
  EXPECT_EQ(chosen_gpu().index_or_name, "0");
  EXPECT_TRUE(chosen_gpu().may_be_approximate);
  choose_gpu("approximate");
  EXPECT_EQ(chosen_gpu().index_or_name, "");
  EXPECT_TRUE(chosen_gpu().may_be_approximate);
  expect_contains(error_of([] { choose_gpu("no such card,approximate"); }),
                  "no GPU 'no such card'");
  choose_gpu("0");
  EXPECT_FALSE(chosen_gpu().may_be_approximate);
  choose_gpu("");
}

TEST(GpuFailures, ADamagedMapIsRefused) {
  SKIP_WITHOUT_DEVICE();
  ShapeScene scene;
  scene.add_box({0, 0, 0}, {2, 2, 2});
  ImportOptions options;
  options.resolution = 0.1;
  std::vector<CloudPoint> points;
  scene.sample(2000.0, 0.0, 1, [&](const Vector3d& p) { points.push_back({p, 0.0f}); });
  const ImportedMap made = testing::import_points(points, options);
  auto bytes = map_bytes(made.tree, made.description);
  bytes[kMapHeaderSize + 200] =
      static_cast<std::byte>(~static_cast<unsigned>(bytes[kMapHeaderSize + 200]));
  const std::string error = error_of([&] {
    static_cast<void>(make_gpu_renderer(Scene{SurfelMap::from_bytes(bytes, "bad.pfmap")}));
  });
  expect_contains(error, "bad.pfmap");
}

TEST(GpuQueue, RenderingsAreCollectedInAnyOrderOrNotAtAll) {
  SKIP_WITHOUT_DEVICE();
  const Executor executor(2);
  const auto renderer = make_gpu_renderer(Scene{trial_scene()});
  for (int repeat = 0; repeat < 3; ++repeat) {
    std::vector<std::unique_ptr<Jobs>> jobs;
    std::vector<std::unique_ptr<Rendering>> renderings;
    for (std::size_t k = 0; k < 7; ++k) {
      jobs.push_back(std::make_unique<Jobs>(1 + k % 3));
      renderings.push_back(renderer->submit(jobs.back()->all, executor));
    }
    for (const std::size_t k : {3, 0, 6, 2, 5}) {
      renderings[k]->collect();
      expect_those_of_beam(*jobs[k]);
    }
    renderings.clear();  // 1 and 4 never were
  }
}

TEST(GpuQueue, SeveralThreadsAndRenderersShareADevice) {
  SKIP_WITHOUT_DEVICE();
  const auto first = make_gpu_renderer(Scene{trial_scene()});
  const auto second = make_gpu_renderer(Scene{trial_scene()});
  const Executor executor(2);
  std::vector<std::jthread> threads;
  std::vector<std::unique_ptr<Jobs>> jobs;
  for (int k = 0; k < 4; ++k) jobs.push_back(std::make_unique<Jobs>(2));
  for (std::size_t k = 0; k < 4; ++k) {
    threads.emplace_back([&, k] { (k % 2 == 0 ? first : second)->render(jobs[k]->all, executor); });
  }
  threads.clear();
  for (const auto& own : jobs) expect_those_of_beam(*own);
  // and tasks of a loop, whose threads may be given each other's work while they wait
  executor.parallel_for(4, 1, [&](std::size_t k, std::size_t) {
    *jobs[k] = Jobs(2);
    first->render(jobs[k]->all, executor);
  });
  for (const auto& own : jobs) expect_those_of_beam(*own);
}

}  // namespace
}  // namespace pointflight
