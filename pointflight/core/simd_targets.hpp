#pragma once

// Which instruction sets the kernels are compiled for; included before hwy/foreach_target.h.
// AVX3_DL brings nothing that they use; vectors without a fixed size cannot be members (SVE, RVV).
// Under the sanitizers AVX2 and plain code are enough: each target takes a compiler minutes there.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define POINTFLIGHT_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define POINTFLIGHT_SANITIZED 1
#endif
#endif

#ifdef POINTFLIGHT_SANITIZED
#define HWY_DISABLED_TARGETS                                                          \
  (HWY_AVX3_DL | HWY_AVX3 | HWY_SSE4 | HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | \
   HWY_SVE2_128 | HWY_RVV)
// one large function would take them longer than many small ones
#define POINTFLIGHT_INLINE inline
#else
#define HWY_DISABLED_TARGETS \
  (HWY_AVX3_DL | HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#define POINTFLIGHT_INLINE HWY_INLINE
#endif
