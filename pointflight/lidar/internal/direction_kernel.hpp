// Noise of beams' directions, many at a time.
#pragma once

#include <cstddef>

#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// Turns each ray by `u` and `v`, in units of `sigma` (rad), about two axes across it: the same
/// bits with every instruction set.
void turn_rays(Ray* rays, std::size_t count, const double* u, const double* v, double sigma);

}  // namespace pointflight
