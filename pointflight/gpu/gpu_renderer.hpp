#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// Adds the renderers "gpu" and "auto" to `RendererKind::table`, the bits of "beam" on the device
/// that `choose_gpu` names, or where there is one and it is worth it; and "gpu-paper", those of
/// "paper". Programs call it before they
/// read scenarios; more than once does no harm.
void add_gpu_renderer();

/// One of a scene, on the device that `choose_gpu` names. Throws InputError if there is none, if it
/// cannot hold the map, or if it has not this processor's bits.
std::unique_ptr<Renderer> make_gpu_renderer(const Scene& scene);

/// "paper" on that device, as the paper's own simulator does it: points are splatted into a depth
/// image. Throws InputError as above.
std::unique_ptr<Renderer> make_gpu_paper_renderer(const Scene& scene);

/// `make_gpu_renderer`, or "beam" if there is no device but this processor, if it cannot be had, or
/// for batches of few rays.
std::unique_ptr<Renderer> make_automatic_renderer(const Scene& scene);

/// What went wrong with devices since this was last asked, in a sentence each: those that were
/// lost, for which the processor renders from then on, and those that "auto" could not use. For
/// programs to say.
std::vector<std::string> take_gpu_notices();

}  // namespace pointflight
