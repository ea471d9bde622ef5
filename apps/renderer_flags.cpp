#include "apps/renderer_flags.hpp"

#include "apps/flags.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/gpu/gpu_list.hpp"
#include "pointflight/gpu/gpu_renderer.hpp"

namespace pointflight::apps {

void add_renderer_flags(CLI::App& app, RendererFlags& flags, const std::string& help) {
  auto* renderer = app.add_option("--renderer", flags.renderer, help);
  renderer->check(CLI::IsMember(renderer_names()));
  if (!flags.renderer.empty()) renderer->capture_default_str();
  app.add_option(
      "--gpu", flags.gpu, "Which one renderer gpu takes: its index or a part of its name");
}

void choose_renderer(const RendererFlags& flags) {
  if (flags.gpu.empty()) return;
  if (!flags.renderer.empty() && flags.renderer != "gpu") {
    throw InputError("--gpu has no effect without --renderer gpu");
  }
  choose_gpu(flags.gpu);
}

void say_gpu_notices() {
  for (const std::string& notice : take_gpu_notices()) log(notice);
}

void RendererPart::prepare(Scenario& scenario, double /*rate*/) {
  choose_renderer(flags_);
  bool has_gpu = false;
  for (VehicleSetup& vehicle : scenario.vehicles) {
    for (LidarMount& mount : vehicle.lidars) {
      if (!flags_.renderer.empty()) mount.renderer = flags_.renderer;
      has_gpu = has_gpu || mount.renderer->name == "gpu";
    }
  }
  if (!flags_.gpu.empty() && !has_gpu) {
    throw InputError("--gpu has no effect: no LiDAR has renderer gpu");
  }
}

void RendererPart::report(const RunLoop& /*loop*/) const {
  say_gpu_notices();
}

}  // namespace pointflight::apps
