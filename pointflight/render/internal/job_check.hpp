#pragma once

#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// Throws std::invalid_argument unless a job is one that `Renderer::submit` takes: for renderers
/// that submit by themselves.
void require_valid(const RenderJob& job);

}  // namespace pointflight
