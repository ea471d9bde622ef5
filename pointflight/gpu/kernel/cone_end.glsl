// What comes of a wide beam at the end of its way. After cone_way.glsl.

/// A surfel that counts lies in front of what eight hit, or of `all` if that is not negative.
bool has_before(float all) {
  float limit[8];
  for (int i = 0; i < 8; ++i) {
    float hit = all < 0.0f ? eight_range[i] : all;
    precise float before = hit - 0.3f;
    limit[i] = divided(eight_length[i], max(1e-3f, before));
  }
  for (int row = 0; row < c.count; ++row) {
    if (!(touched(row, kAtSolid) > 0.0f)) continue;
    bool nearer = true;
    for (int i = 0; i < 8 && nearer; ++i) {
      nearer = limit[i] < inverse_at(row, eight_u[i], eight_v[i]);
    }
    if (nearer) return true;
  }
  return false;
}

#define OF_EIGHT(a) sum8(a(0), a(1), a(2), a(3), a(4), a(5), a(6), a(7))

float plane_inverse[8];
float sum_of_inverses() {
#define A(i) plane_inverse[i]
  return OF_EIGHT(A);
#undef A
}
/// Of the products with the positions from a word of the tables on, every second.
float sum_of_products(uint table) {
  float product[8];
  for (int i = 0; i < 8; ++i) {
    precise float own = plane_inverse[i] * table_float(table + 2u * uint(i));
    product[i] = own;
  }
#define A(i) product[i]
  return OF_EIGHT(A);
#undef A
}

bool lie_in_plane() {
  for (int i = 0; i < 8; ++i) plane_inverse[i] = divided(1.0f, max(eight_range[i], kOneEcho));
  float per_xx = table_float(kAtPerXx);
  precise float in_middle = 0.125f * sum_of_inverses();
  precise float slope_x = sum_of_products(kAtEight) * per_xx;
  precise float slope_y = sum_of_products(kAtEight + 1u) * per_xx;
  for (int i = 0; i < 8; ++i) {
    precise float fitted = in_middle + slope_x * table_float(kAtEight + 2u * uint(i)) +
                           slope_y * table_float(kAtEight + 2u * uint(i) + 1u);
    if (!(0.0f < fitted)) return false;
    precise float off = divided(1.0f, fitted) - eight_range[i];
    if (!(abs(off) <= 0.2f)) return false;
  }
  return true;
}

float intensity_of(int word) {
  if (map.has_intensity == 0u) return 0.0f;
  uint code = (codes[uint(word) >> 2] >> (8u * (uint(word) & 3u))) & 255u;
  return table_float(kAtLevels + code);
}

float reflectivity_of(int word, float intensity, float cosine) {
  precise float reflectivity = call.same;
  if (call.per_intensity > 0.0f) {
    reflectivity = intensity * call.per_intensity;
  } else if (call.same <= 0.0f) {
    reflectivity = table_float(kAtUsual + ((uint(word) * 2654435769u) >> 20));
  }
  precise float seen = reflectivity * cosine;
  return max(call.least, seen);
}

/// The eight as one echo.
WideResult echo_of_eight() {
  float energy[8];
  float by_range[8];
  float light[8];
  float by_intensity[8];
  float most = 0.0f;
  float nearest = kNever;
  float farthest = 0.0f;
  for (int i = 0; i < 8; ++i) {
    float range = eight_range[i];
    float intensity = intensity_of(eight_word[i]);
    precise float own = table_float(kAtShares + uint(i)) *
                        reflectivity_of(eight_word[i], intensity, eight_cosine[i]);
    float near = max(range, kOneEcho);
    precise float near2 = near * near;
    float strength = divided(own, near2);
    precise float ranged = strength * range;
    precise float shone = strength * intensity;
    light[i] = own;
    energy[i] = strength;
    by_range[i] = ranged;
    by_intensity[i] = shone;
    most = max(most, strength);
    nearest = min(nearest, range);
    farthest = max(farthest, range);
  }
  int first = 7;
  for (int i = 6; i >= 0; --i) {
    if (most <= energy[i]) first = i;
  }
#define A(i) energy[i]
  float all = OF_EIGHT(A);
#undef A
#define A(i) by_range[i]
  float ranges = OF_EIGHT(A);
#undef A
#define A(i) light[i]
  float lights = OF_EIGHT(A);
#undef A
#define A(i) by_intensity[i]
  float intensities = OF_EIGHT(A);
#undef A
  precise float depth = farthest - nearest;
  WideResult result;
  result.kind = kOneEchoOfAll;
  result.range = divided(ranges, all);
  result.reflectivity = lights;
  result.intensity = divided(intensities, all);
  result.depth = depth;
  result.cosine = eight_cosine[first];
  result.surfel = uint(eight_word[first]);
  result.sub_ray = uint(first);
  return result;
}

WideResult result_of(uint kind) {
  WideResult result;
  result.kind = kind;
  result.range = 0.0f;
  result.reflectivity = 0.0f;
  result.intensity = 0.0f;
  result.depth = 0.0f;
  result.cosine = 0.0f;
  result.surfel = 0u;
  result.sub_ray = 0u;
  return result;
}

/// The end of the way: one echo, nothing, or that more sub-rays are wanted or the processor.
WideResult end_cone() {
  if (c.is_lossless && c.count > 0 && c.looked != c.count) look();
  if (!c.is_lossless) return result_of(kLeftToProcessor);
  if (c.count == 0) return result_of(kNoEcho);
  int hits = 0;
  for (int i = 0; i < 8; ++i) hits += eight_range[i] < kNever ? 1 : 0;
  bool settled = hits == 0 || (hits == 8 && lie_in_plane());
  if (settled) settled = !has_before(-1.0f);
  if (!settled) return result_of(kMoreSubRays);
  if (hits == 0) return result_of(kNoEcho);
  return echo_of_eight();
}

/// Where the second level's sub-rays of this beam begin in the tables.
uint second_level() {
  for (int i = 0; i < 8; ++i) plane_inverse[i] = divided(1.0f, max(eight_range[i], 1.0f));
  float x = sum_of_products(kAtEight);
  float y = sum_of_products(kAtEight + 1u);
  float most = -1.0f;
  uint direction = 7u;
  for (uint k = 0u; k < 8u; ++k) {
    precise float along = x * table_float(kAtStrips + 2u * k) + y * table_float(kAtStrips + 2u * k + 1u);
    if (abs(along) > most) {
      most = abs(along);
      direction = k;
    }
  }
  return kAtSecond + 64u * direction;
}

#undef OF_EIGHT
