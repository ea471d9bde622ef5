// Quotients and roots as IEEE 754 has them, which GLSL does not promise (a division may be off by
// 2.5 units in the last place).
//
// EXACT_BY 0: the device's own; 1: by residuals, which a fused multiply-add gives exactly where
// there is one; 2: through double.

// What devices do inexactly; tests let it be as far off as is allowed.
#ifndef ROUGH_INVERSE
#define ROUGH_INVERSE(x) (1.0f / (x))
#define ROUGH_ROOT(x) sqrt(x)
#endif

#if EXACT_BY == 1
// The inverse by Newton, then the residual (Markstein, IA-64 and Elementary Functions, 2000, 8.2).
float divided(float a, float b) {
  precise float inverse = ROUGH_INVERSE(b);
  precise float e = fma(-b, inverse, 1.0f);
  precise float better = fma(inverse, e, inverse);
  precise float q = a * better;
  precise float r = fma(-q, b, a);
  precise float best = fma(r, better, q);
  return best;
}
/// Near 1 roots lie close to the middle between two floats: which is nearer is decided by the exact
/// residual.
float root_of(float x) {
  if (!(x > 0.0f)) return 0.0f;
  precise float rough = ROUGH_ROOT(x);
  precise float half_inverse = 0.5f * ROUGH_INVERSE(rough);
  precise float off = fma(-rough, rough, x);
  precise float root = fma(off, half_inverse, rough);
  uint bits = floatBitsToUint(root);
  float step = uintBitsToFloat((bits & 0x7f800000u) - 0x0b800000u);
  float step_down = (bits & 0x7fffffu) == 0u ? 0.5f * step : step;
  precise float rest = fma(-root, root, x);
  precise float up = root * step;
  precise float down = root * step_down;
  if (rest > up) return uintBitsToFloat(bits + 1u);
  if (rest <= -down) return uintBitsToFloat(bits - 1u);
  return root;
}
#elif EXACT_BY == 2
float divided(float a, float b) { return float(double(a) / double(b)); }
float root_of(float x) { return x > 0.0f ? float(sqrt(double(x))) : 0.0f; }
#else
float divided(float a, float b) { return a / b; }
float root_of(float x) { return x > 0.0f ? sqrt(x) : 0.0f; }
#endif
