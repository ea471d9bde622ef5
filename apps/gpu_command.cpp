#include <fmt/format.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/commands.hpp"
#include "pointflight/core/parallel.hpp"
#include "pointflight/gpu/gpu_list.hpp"
#include "pointflight/gpu/gpu_trial.hpp"

namespace pointflight::apps {
namespace {

struct GpuFlags {
  std::string gpu;
  bool json = false;
};

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

/// Rays a second; at least one round, and some tenths of a second.
template <class Action>
double speed_of(const GpuTrial& trial, const Action& round) {
  using Clock = std::chrono::steady_clock;
  constexpr double kLongEnough = 0.3;  // s
  round();                             // once for what is made at first
  const auto begin = Clock::now();
  double rounds = 0.0;
  double seconds = 0.0;
  do {
    round();
    rounds += 1.0;
    seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  } while (seconds < kLongEnough);
  return rounds * static_cast<double>(trial.rays()) / seconds;
}

void print_test(const GpuFlags& flags) {
  const GpuInfo gpu = find_gpu(flags.gpu);
  const Executor executor;
  GpuTrial trial(flags.gpu);
  const double there = speed_of(trial, [&] { trial.trace_on_device(); });
  const double here = speed_of(trial, [&] { trial.trace_on_processor(executor); });
  if (flags.json) {
    const nlohmann::json out = {{"name", gpu.name},
                                {"driver", gpu.driver},
                                {"exact_by", trial.exact_by()},
                                {"rays", trial.rays()},
                                {"equal", trial.equal()},
                                {"rays_per_second", there},
                                {"processor_rays_per_second", here}};
    fmt::print("{}\n", out.dump(2));
    return;
  }
  fmt::print("{} {}\n", gpu.index, gpu.name);
  fmt::print("  {} of {} rays have this processor's bits\n", trial.equal(), trial.rays());
  fmt::print("  divides exactly by {}\n",
             trial.exact_by().empty() ? "no way that was tried: --renderer gpu is refused"
                                      : trial.exact_by());
  fmt::print(
      "  {:.1f} M rays/s there and back, {:.1f} M on this processor\n", 1e-6 * there, 1e-6 * here);
}

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
