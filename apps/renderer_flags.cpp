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
  app.add_option("--gpu",
                 flags.gpu,
                 "Which one renderers on a GPU take: its index or a part of its name; approximate: "
                 "one with other bits than the processor's will do");
}

namespace {

bool may_use_gpu(const std::string& renderer) {
  return renderer == "gpu" || renderer == "gpu-paper" || renderer == "auto";
}

}  // namespace

void choose_renderer(const RendererFlags& flags) {
  if (flags.gpu.empty()) return;
  if (!flags.renderer.empty() && !may_use_gpu(flags.renderer)) {
    throw InputError("--gpu has no effect without --renderer gpu, gpu-paper or auto");
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
      has_gpu = has_gpu || may_use_gpu(mount.renderer->name);
    }
  }
  if (!flags_.gpu.empty() && !has_gpu) {
    throw InputError("--gpu has no effect: no LiDAR has renderer gpu, gpu-paper or auto");
  }
}

void RendererPart::report(const RunLoop& /*loop*/) const {
  say_gpu_notices();
}

}  // namespace pointflight::apps
