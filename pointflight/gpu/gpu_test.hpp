#pragma once

#include <cstddef>
#include <string>

#include "pointflight/core/parallel.hpp"

namespace pointflight {

/// How a device fares on a small scene of its own.
struct GpuTest {
  std::string exact_by;          ///< How it divides exactly; empty: no way was found.
  std::size_t rays = 0;          ///< That were compared.
  std::size_t equal = 0;         ///< Whose range, incidence and surfel are the processor's.
  double speed = 0.0;            ///< Rays a second, there and back.
  double processor_speed = 0.0;  ///< The same rays on this processor, by all its threads.
};

/// Compares the device that `find_gpu` finds with this processor, ray by ray. Takes about a second.
/// Throws InputError if it cannot be used at all.
GpuTest test_gpu(const std::string& index_or_name, const Executor& executor);

}  // namespace pointflight
