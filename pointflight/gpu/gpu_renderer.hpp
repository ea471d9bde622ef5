#pragma once

#include <string>
#include <vector>

#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// Adds the renderer "gpu" to `RendererKind::table`: the bits of "beam", on the device that
/// `choose_gpu` names. Programs call it before they read scenarios; more than once does no harm.
void add_gpu_renderer();

/// What went wrong with devices since this was last asked, in a sentence each: those that were
/// lost, for which the processor renders from then on. For programs to say.
std::vector<std::string> take_gpu_notices();

}  // namespace pointflight
