// Compiles the kernel once for each instruction set and picks one at run time.
#include "pointflight/render/internal/beam_kernel.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/internal/simd_targets-inl.hpp"
// for foreach_target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pointflight/render/internal/beam_kernel.cpp"
#include <hwy/foreach_target.h>
// after foreach_target
#include "pointflight/render/internal/trace-inl.hpp"

#if HWY_ONCE
namespace pointflight {
namespace {

HWY_EXPORT(trace);

}  // namespace

KernelMap kernel_map_of(const SurfelMap& map) {
  const RenderModel& m = map.model();
  KernelMap k{};
  k.nodes = map.nodes().data();
  k.node_count = map.nodes().size();
  k.words = map.words().data();
  k.word_count = map.words().size();
  for (int axis = 0; axis < 3; ++axis) k.origin[axis] = map.origin_world()[axis];
  k.resolution = map.resolution();
  k.r = static_cast<float>(map.resolution());
  k.support = m.support;
  k.support_squared = m.support * m.support;
  k.inverse_support = 1.0f / k.support_squared;
  // c = 36 / (pi M^2): the weights of a covered plane average 1
  k.weight_scale = kWeightOne * 36.0f / (static_cast<float>(kPi) * k.support_squared);
  k.scale = map.scale();
  k.window = m.window * k.r;
  k.widest_group = std::min(0.036f, 0.23f * k.r);
  k.tau = static_cast<std::int32_t>(m.tau * kWeightOne);
  return k;
}

std::uint64_t trace_beams(const KernelMap& map,
                          std::span<const MapRay> rays,
                          std::span<const std::uint32_t> order,
                          std::span<KernelHit> hits,
                          BeamGrouping grouping) {
  return HWY_DYNAMIC_DISPATCH(trace)(
      map, rays.data(), order.data(), order.size(), grouping, hits.data());
}

std::vector<std::string> kernel_names() {
  std::vector<std::string> names;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    names.emplace_back(hwy::TargetName(target));
  }
  return names;
}

void use_kernel(const std::string& name) {
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().DeInit();
  if (name.empty()) return;
  std::string known;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    known += (known.empty() ? "" : ", ") + std::string(hwy::TargetName(target));
    if (name != hwy::TargetName(target)) continue;
    hwy::GetChosenTarget().Update(target);
    return;
  }
  throw InputError(fmt::format("no kernel '{}' here; known: {}", name, known));
}

}  // namespace pointflight
#endif  // HWY_ONCE
