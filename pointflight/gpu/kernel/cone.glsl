// One wide beam through the hierarchy, to the bits of the processor's (docs/architecture.md, "Wide
// beams"; render/internal/cone-inl.hpp and what it includes, where the formulas are said).
//
// GLSL and C++. Before it: layout.glsl, exact.glsl, aim.glsl, `map`, `nodes`, `words`, `tables`
// (uint words: WideTables) and `codes` (uint words: a byte for each word of the map), and a list of
// kMostTouched rows of kTouchedNumbers floats, by `touched(row, number)` and `set_touched`.

// rows of the list
const uint kAtM2 = 0u;        // six: of 1, u, v, u^2, u v, v^2
const uint kAtInverse = 6u;   // three: of 1, u, v; 1/m
const uint kAtCosine = 9u;    // in whole steps
const uint kAtNearest = 10u;  // 1/m
const uint kAtSolid = 11u;    // 1 or 0
const uint kAtWord = 12u;     // as bits

const float kConeCosineSteps = 512.0f;
const float kLookAtCover = 0.6f * 1024.0f;
const float kOneEcho = 0.01f;  // kNearestEcho

/// A beam on its way: axes of the map u, v, w, of which it looks along w.
struct ConeState {
  DeviceRay ray;
  uint u;
  uint v;
  uint w;
  float forward;
  float du;  // direction
  float dv;
  float dw;
  float au;  // a sigma across
  float av;
  float aw;
  float bu;  // a sigma up
  float bv;
  float bw;
  float axis_length;
  float shortest;
  float at_u;
  float at_v;
  float half_uu;
  float uv;
  float half_vv;
  float det;
  float wide_u;
  float wide_v;
  float start_u;  // from the map's origin, m
  float start_v;
  float start_w;
  float end;
  float deepest;
  float cover;
  float farthest;
  float look_behind;  // depth
  int count;
  int looked;
  int depth;  // of the stack
  uint next;
  uint index;
  bool is_lossless;
};
ConeState c;
uvec2 cone_stack[kMostEntries];
// the eight of the first level: as they are seen, and what they hit
float eight_u[8];
float eight_v[8];
float eight_length[8];
float eight_range[8];
float eight_cosine[8];
int eight_word[8];
// what one sub-ray hits
float row_t[kMostRows];
float row_weight[kMostRows];
int row_at[kMostRows];
float sub_first;  // where its surface begins
float sub_range;
float sub_cosine;
int sub_word;

float table_float(uint word) { return uintBitsToFloat(tables[word]); }

float pick(float x, float y, float z, uint axis) { return axis == 0u ? x : (axis == 1u ? y : z); }
uint pick_word(uint x, uint y, uint z, uint axis) { return axis == 0u ? x : (axis == 1u ? y : z); }

/// In one order everywhere.
float sum8(float a0, float a1, float a2, float a3, float a4, float a5, float a6, float a7) {
  precise float all = ((a0 + a1) + (a2 + a3)) + ((a4 + a5) + (a6 + a7));
  return all;
}

/// 0 to 2^22, as a whole number.
float whole(float x) {
  precise float large = x + 12582912.0f;
  precise float back = large - 12582912.0f;
  return back;
}

float soft_weight(float m2) {
  precise float share = 1.0f - m2 * map.inverse_support;
  precise float weight = map.soft_scale * share * share;
  return whole(weight);
}

void set_end(float end) {
  c.end = end;
  c.deepest = divided(end, c.shortest);
}

/// `across`: unit vector, world; `beam`: its number, by which its sub-rays are turned.
void start_cone(DeviceRay ray, float across_x, float across_y, float across_z, uint beam) {
  c.ray = ray;
  float ax = abs(ray.x);
  float ay = abs(ray.y);
  float az = abs(ray.z);
  c.w = az >= ax && az >= ay ? 2u : (ay >= ax ? 1u : 0u);
  c.u = (c.w + 1u) % 3u;
  c.v = (c.w + 2u) % 3u;
  c.forward = pick(ray.x, ray.y, ray.z, c.w) < 0.0f ? -1.0f : 1.0f;
  precise float up_x = ray.y * across_z - ray.z * across_y;
  precise float up_y = ray.z * across_x - ray.x * across_z;
  precise float up_z = ray.x * across_y - ray.y * across_x;
  uint turn = kAtTurns + 2u * (beam % 64u);
  float cosine = table_float(turn);
  float sine = table_float(turn + 1u);
#define SECTION(k)                                           \
  precise float along_##k = call.sigma_across * across_##k;  \
  precise float upward_##k = call.sigma_up * up_##k;         \
  precise float one_##k = cosine * along_##k + sine * upward_##k; \
  precise float two_##k = cosine * upward_##k - sine * along_##k;
  SECTION(x)
  SECTION(y)
  SECTION(z)
#undef SECTION
  c.du = pick(ray.x, ray.y, ray.z, c.u);
  c.dv = pick(ray.x, ray.y, ray.z, c.v);
  c.dw = c.forward * pick(ray.x, ray.y, ray.z, c.w);
  c.au = pick(one_x, one_y, one_z, c.u);
  c.av = pick(one_x, one_y, one_z, c.v);
  c.aw = c.forward * pick(one_x, one_y, one_z, c.w);
  c.bu = pick(two_x, two_y, two_z, c.u);
  c.bv = pick(two_x, two_y, two_z, c.v);
  c.bw = c.forward * pick(two_x, two_y, two_z, c.w);
  c.axis_length = divided(1.0f, c.dw);
  precise float at_u = c.du * c.axis_length;
  precise float at_v = c.dv * c.axis_length;
  c.at_u = at_u;
  c.at_v = at_v;
  precise float a_u = (c.au - at_u * c.aw) * c.axis_length;
  precise float a_v = (c.av - at_v * c.aw) * c.axis_length;
  precise float b_u = (c.bu - at_u * c.bw) * c.axis_length;
  precise float b_v = (c.bv - at_v * c.bw) * c.axis_length;
  precise float uu = a_u * a_u + b_u * b_u;
  precise float vv = a_v * a_v + b_v * b_v;
  precise float det = a_u * b_v - a_v * b_u;
  precise float half_uu = 0.5f * uu;
  precise float uv = a_u * a_v + b_u * b_v;
  precise float half_vv = 0.5f * vv;
  precise float det2 = det * det;
  precise float wide_u = map.cone_radius * root_of(uu);
  precise float wide_v = map.cone_radius * root_of(vv);
  c.half_uu = half_uu;
  c.uv = uv;
  c.half_vv = half_vv;
  c.det = det2;
  c.wide_u = wide_u;
  c.wide_v = wide_v;
  precise float least_u = max(0.0f, abs(at_u) - wide_u);
  precise float least_v = max(0.0f, abs(at_v) - wide_v);
  precise float shortest = 1.0f + (least_u * least_u + least_v * least_v);
  c.shortest = root_of(shortest);
  float start_x = float(ray.voxel_x) * map.r + ray.rest_x;
  float start_y = float(ray.voxel_y) * map.r + ray.rest_y;
  float start_z = float(ray.voxel_z) * map.r + ray.rest_z;
  c.start_u = pick(start_x, start_y, start_z, c.u);
  c.start_v = pick(start_x, start_y, start_z, c.v);
  c.start_w = pick(start_x, start_y, start_z, c.w);
  set_end(ray.range_max);
  c.cover = 0.0f;
  c.farthest = 0.0f;
  c.look_behind = kNever;
  c.count = 0;
  c.looked = 0;
  c.depth = 0;
  c.next = map.node_count > 0u ? kInner : kDone;
  c.index = 0u;
  c.is_lossless = true;
}

// ---- sub-rays

/// The inverse depth of the surfel in a row at (u, v) beside the axis.
float inverse_at(int row, float u, float v) {
  precise float inverse = touched(row, kAtInverse) + touched(row, kAtInverse + 1u) * u +
                          touched(row, kAtInverse + 2u) * v;
  return inverse;
}

float seen_u;
float seen_v;
float seen_length;

/// A sub-ray by its position in sigmas.
void see_sub_ray(float x, float y) {
  precise float along_u = c.du + (c.au * x + c.bu * y);
  precise float along_v = c.dv + (c.av * x + c.bv * y);
  precise float along_w = c.dw + (c.aw * x + c.bw * y);
  float per_depth = divided(1.0f, along_w);
  precise float u = along_u * per_depth;
  precise float v = along_v * per_depth;
  precise float square = 1.0f + (u * u + v * v);
  precise float beside_u = u - c.at_u;
  precise float beside_v = v - c.at_v;
  seen_u = beside_u;
  seen_v = beside_v;
  seen_length = root_of(square);
}

/// Where the surface begins for the rows of a sub-ray, or kNever.
float surface_of_rows(int rows, float total, float nearest, float farthest) {
  if (!(map.soft_tau <= total)) return kNever;
  precise float first_end = nearest + map.window;
  if (farthest <= first_end) return nearest;
  float tried = nearest;
  for (;;) {
    precise float end = tried + map.window;
    float next = kNever;
    float weight = 0.0f;
    for (int i = 0; i < rows; ++i) {
      float t = row_t[i];
      if (tried <= t && t <= end) weight += row_weight[i];
      if (tried < t && t < next) next = t;
    }
    if (map.soft_tau <= weight) return tried;
    if (next == kNever) return kNever;
    tried = next;
  }
}

/// What the sub-ray that was seen last hits up to the end, into `sub_range` and so on.
void hit_sub_ray() {
  sub_first = kNever;
  sub_range = kNever;
  sub_cosine = 0.0f;
  sub_word = 0;
  precise float uu = seen_u * seen_u;
  precise float uv = seen_u * seen_v;
  precise float vv = seen_v * seen_v;
  int rows = 0;
  float nearest = kNever;
  float farthest = 0.0f;
  float total = 0.0f;
  for (int i = 0; i < c.count; ++i) {
    precise float m2 = touched(i, kAtM2) +
                       (touched(i, kAtM2 + 1u) * seen_u + touched(i, kAtM2 + 2u) * seen_v) +
                       (touched(i, kAtM2 + 3u) * uu + touched(i, kAtM2 + 4u) * uv +
                        touched(i, kAtM2 + 5u) * vv);
    if (!(m2 < map.support_squared)) continue;
    float t = divided(seen_length, inverse_at(i, seen_u, seen_v));
    if (!(0.0f < t && t <= c.end)) continue;
    if (rows == kMostRows) {
      c.is_lossless = false;
      return;
    }
    float weight = soft_weight(m2);
    row_t[rows] = t;
    row_weight[rows] = weight;
    row_at[rows] = i;
    rows += 1;
    nearest = min(nearest, t);
    farthest = max(farthest, t);
    total += weight;
  }
  float first = surface_of_rows(rows, total, nearest, farthest);
  if (first == kNever) return;
  sub_first = first;
  precise float end = first + map.window;
  float weights = 0.0f;
  float depth = 0.0f;
  float cosine = 0.0f;
  float largest = -1.0f;
  int strongest = 0;
  for (int i = 0; i < rows; ++i) {
    float t = row_t[i];
    if (!(first <= t && t <= end)) continue;
    float weight = row_weight[i];
    precise float behind = (t - first) * map.depth_steps_per_metre;
    precise float deeper = depth + weight * whole(behind);
    precise float turned = cosine + weight * touched(row_at[i], kAtCosine);
    depth = deeper;
    cosine = turned;
    weights += weight;
    int word = int(floatBitsToUint(touched(row_at[i], kAtWord)));
    if (largest < weight) {
      strongest = word;
    } else if (largest <= weight && word < strongest) {
      strongest = word;
    }
    largest = max(largest, weight);
  }
  float per = divided(1.0f, weights);
  precise float mean = first + depth * per * map.metres_per_depth_step;
  precise float mean_cosine = cosine * per * (1.0f / kConeCosineSteps);
  sub_range = mean;
  sub_cosine = min(1.0f, mean_cosine);
  sub_word = strongest;
}

/// The eight of the first level, up to the end. If all have hit something the beam ends behind the
/// farthest.
void look() {
  float farthest = 0.0f;
  for (int i = 0; i < 8; ++i) {
    seen_u = eight_u[i];
    seen_v = eight_v[i];
    seen_length = eight_length[i];
    hit_sub_ray();
    eight_range[i] = sub_range;
    eight_cosine[i] = sub_cosine;
    eight_word[i] = sub_word;
    farthest = max(farthest, sub_first);
  }
  c.looked = c.count;
  c.cover = 0.0f;
  c.look_behind = kNever;
  if (farthest == kNever) return;
  precise float behind = farthest + 1.5f * map.window;
  set_end(min(c.end, behind));
  int kept = 0;
  for (int i = 0; i < c.count; ++i) {
    precise float reached = touched(i, kAtNearest) * c.deepest;
    if (!(1.0f <= reached)) continue;
    for (uint k = 0u; k < kTouchedNumbers; ++k) set_touched(kept, k, touched(i, k));
    kept += 1;
  }
  c.count = kept;
  c.looked = kept;
}

/// Once after `start_cone`.
void see_eight() {
  for (int i = 0; i < 8; ++i) {
    see_sub_ray(table_float(kAtEight + 2u * uint(i)), table_float(kAtEight + 2u * uint(i) + 1u));
    eight_u[i] = seen_u;
    eight_v[i] = seen_v;
    eight_length[i] = seen_length;
  }
}
