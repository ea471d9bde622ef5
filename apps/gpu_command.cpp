#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/parallel.hpp"
#if POINTFLIGHT_WITH_GPU
#include "pointflight/gpu/gpu_list.hpp"
#include "pointflight/gpu/gpu_test.hpp"
#endif

namespace pointflight::apps {
namespace {

struct GpuFlags {
  std::string gpu;
  bool json = false;
};

#if POINTFLIGHT_WITH_GPU

std::string gigabytes(std::uint64_t bytes) {
  return fmt::format("{:.1f} GB", 1e-9 * static_cast<double>(bytes));
}

void print_gpus(const GpuFlags& flags) {
  const std::vector<GpuInfo> gpus = list_gpus();
  if (flags.json) {
    auto list = nlohmann::json::array();
    for (const GpuInfo& gpu : gpus) {
      list.push_back({{"index", gpu.index},
                      {"name", gpu.name},
                      {"driver", gpu.driver},
                      {"vulkan", gpu.api},
                      {"memory", gpu.memory},
                      {"largest_buffer", gpu.largest_buffer},
                      {"subgroup", gpu.subgroup},
                      {"doubles", gpu.has_doubles},
                      {"processor", gpu.is_processor}});
    }
    fmt::print("{}\n", list.dump(2));
    return;
  }
  for (const GpuInfo& gpu : gpus) {
    fmt::print("{} {}{}\n", gpu.index, gpu.name, gpu.is_processor ? " (on the processor)" : "");
    fmt::print("  driver {}, Vulkan {}\n", gpu.driver, gpu.api);
    fmt::print("  {} of memory, buffers up to {}, {} lanes{}\n",
               gigabytes(gpu.memory),
               gigabytes(gpu.largest_buffer),
               gpu.subgroup,
               gpu.has_doubles ? ", doubles" : "");
  }
}

void print_test(const GpuFlags& flags) {
  const GpuInfo gpu = find_gpu(flags.gpu);
  const GpuTest test = test_gpu(flags.gpu, Executor());
  if (flags.json) {
    const nlohmann::json out = {{"name", gpu.name},
                                {"driver", gpu.driver},
                                {"exact_by", test.exact_by},
                                {"rays", test.rays},
                                {"equal", test.equal},
                                {"rays_per_second", test.speed},
                                {"processor_rays_per_second", test.processor_speed}};
    fmt::print("{}\n", out.dump(2));
    return;
  }
  fmt::print("{} {}\n", gpu.index, gpu.name);
  fmt::print("  {} of {} rays have this processor's bits\n", test.equal, test.rays);
  fmt::print(
      "  divides exactly by {}\n",
      test.exact_by.empty() ? "no way that was tried: --renderer gpu is refused" : test.exact_by);
  fmt::print("  {:.1f} M rays/s there and back, {:.1f} M on this processor\n",
             1e-6 * test.speed,
             1e-6 * test.processor_speed);
}

#else

[[noreturn]] void refuse() {
  throw InputError(
      "gpu: this build has no Vulkan; install libvulkan-dev and glslang-tools and build again");
}
void print_gpus(const GpuFlags& /*flags*/) {
  refuse();
}
void print_test(const GpuFlags& /*flags*/) {
  refuse();
}

#endif

}  // namespace

void add_gpu_command(CLI::App& parent, int& /*exit_code*/) {
  auto* app = parent.add_subcommand("gpu", "Devices that --renderer gpu renders on");
  app->require_subcommand(1);
  auto flags = std::make_shared<GpuFlags>();
  auto* info = app->add_subcommand("info", "All of them: drivers and limits");
  info->add_flag("--json", flags->json, "JSON on stdout");
  info->callback([flags] { print_gpus(*flags); });
  auto* test = app->add_subcommand(
      "test", "Whether one has this processor's bits, ray by ray, and how fast it is");
  test->add_option("--gpu", flags->gpu, "Its index or a part of its name");
  test->add_flag("--json", flags->json, "JSON on stdout");
  test->callback([flags] { print_test(*flags); });
}

}  // namespace pointflight::apps
