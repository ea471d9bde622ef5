#pragma once

#include <gtest/gtest.h>

#include "pointflight/core/input_error.hpp"
#include "pointflight/gpu/gpu_list.hpp"

namespace pointflight::testing {

inline bool has_device() {
  try {
    return !list_gpus().empty();
  } catch (const InputError&) {
    return false;
  }
}

#define SKIP_WITHOUT_DEVICE()                \
  if (!::pointflight::testing::has_device()) \
  GTEST_SKIP() << "no Vulkan device (Debian: libvulkan1 mesa-vulkan-drivers)"

}  // namespace pointflight::testing
