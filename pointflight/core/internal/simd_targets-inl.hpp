#pragma once

// Which instruction sets the kernels are compiled for; included before hwy/foreach_target.h.
// AVX3_DL and later ones bring nothing that they use; vectors without a fixed size cannot be
// members (SVE, RVV); gcc does not compile constructors of members for NEON_BF16. Under the
// sanitizers AVX2 and plain code are enough: each target takes a compiler minutes there.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define POINTFLIGHT_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define POINTFLIGHT_SANITIZED 1
#endif
#endif

#define POINTFLIGHT_UNUSED_TARGETS                                                               \
  (HWY_AVX3_SPR | HWY_AVX3_ZEN4 | HWY_AVX3_DL | HWY_SSSE3 | HWY_NEON_BF16 | HWY_SVE | HWY_SVE2 | \
   HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#ifdef POINTFLIGHT_SANITIZED
#define HWY_DISABLED_TARGETS (POINTFLIGHT_UNUSED_TARGETS | HWY_AVX3 | HWY_SSE4 | HWY_SSE2)
// one large function would take them longer than many small ones
#define POINTFLIGHT_INLINE inline
#else
#define HWY_DISABLED_TARGETS POINTFLIGHT_UNUSED_TARGETS
#define POINTFLIGHT_INLINE HWY_INLINE
#endif

#include <hwy/detect_targets.h>

// before Highway 1.0.5
#ifndef HWY_AVX3_SPR
#define HWY_AVX3_SPR 0
#endif
#ifndef HWY_AVX3_ZEN4
#define HWY_AVX3_ZEN4 0
#endif
#ifndef HWY_SSE2
#define HWY_SSE2 0
#endif
#ifndef HWY_NEON_BF16
#define HWY_NEON_BF16 0
#endif
