// Quotients and roots as IEEE 754 has them, which GLSL does not promise (a division may be off by
// 2.5 units in the last place).
//
// EXACT_BY 0: the device's own; 1: by residuals, which a fused multiply-add gives exactly where
// there is one; 2: through double.

#if EXACT_BY == 1
float divided(float a, float b) {
  precise float inverse = 1.0f / b;
  precise float q = a * inverse;
  precise float r = fma(-q, b, a);
  precise float better = fma(r, inverse, q);
  precise float r2 = fma(-better, b, a);
  precise float best = fma(r2, inverse, better);
  return best;
}
float root_of(float x) {
  if (!(x > 0.0f)) return 0.0f;
  precise float root = sqrt(x);
  precise float half_inverse = 0.5f / root;
  precise float r = fma(-root, root, x);
  precise float better = fma(r, half_inverse, root);
  return better;
}
#elif EXACT_BY == 2
float divided(float a, float b) { return float(double(a) / double(b)); }
float root_of(float x) { return float(sqrt(double(x))); }
#else
float divided(float a, float b) { return a / b; }
float root_of(float x) { return sqrt(x); }
#endif
