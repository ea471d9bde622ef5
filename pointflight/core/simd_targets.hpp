#pragma once

// Which instruction sets the kernels are compiled for; included before hwy/foreach_target.h.
// AVX3_DL brings nothing that they use; vectors without a fixed size cannot be members (SVE, RVV).
#define HWY_DISABLED_TARGETS \
  (HWY_AVX3_DL | HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
