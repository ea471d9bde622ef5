// One ray through the hierarchy of a .pfmap by the hit rule of the `beam` renderer, to the bit
// (docs/architecture.md, "Hit rule"; the processor's is render/internal/hit_rule-inl.hpp).
//
// GLSL and C++. Before it: layout.glsl, exact.glsl, `map` (MapNumbers), `nodes` (uvec4, five a
// node) and `words` (uvec2). What is `precise` is computed as it is written, on all devices; the
// rest only decides what is looked at, with room for rounding.

/// A ray on its way.
struct RayState {
  float start_x;  // from the map's origin, for boxes, m
  float start_y;
  float start_z;
  float inverse_x;  // 1 / direction
  float inverse_y;
  float inverse_z;
  DeviceRay ray;
  float end;      // nothing beyond matters
  float first;    // where the surface begins, kNever before one is found
  float nearest;  // hit
  int total;      // of the hits' weights
  int hits;
  int depth;   // of the stack
  uint next;   // kInner, kDone, or surfels of a leaf
  uint index;  // of the node, or of the leaf's header
  bool is_lossless;
};
RayState s;
float hit_t[kMostHits];
int hit_weight[kMostHits];
uint hit_word[kMostHits];
uvec2 stack[kMostEntries];  // where a child is entered and its lane; its node

// ---- the hit rule

/// The nearest hit a for which the weights within [t_a, t_a + window] reach tau, or kNever.
float find_surface() {
  float tried = -1.0f;
  for (;;) {
    float a = kNever;
    for (int i = 0; i < s.hits; ++i) {
      if (hit_t[i] > tried && hit_t[i] < a) a = hit_t[i];
    }
    if (a == kNever) return kNever;
    precise float end = a + map.window;
    int weight = 0;
    for (int i = 0; i < s.hits; ++i) {
      if (hit_t[i] >= a && hit_t[i] <= end) weight += hit_weight[i];
    }
    if (weight >= map.tau) return a;
    tried = a;
  }
}

/// Looks for the surface; what lies behind it no longer matters.
void shorten() {
  float a = find_surface();
  if (a == kNever) return;
  precise float end = a + map.window;
  s.first = a;
  s.end = min(s.end, end);
}

/// Room for another hit: forgets those behind the end. False if all are before it.
bool make_room() {
  shorten();
  int kept = 0;
  s.total = 0;
  for (int i = 0; i < s.hits; ++i) {
    if (hit_t[i] > s.end) continue;
    hit_t[kept] = hit_t[i];
    hit_weight[kept] = hit_weight[i];
    hit_word[kept] = hit_word[i];
    s.total += hit_weight[i];
    ++kept;
  }
  s.hits = kept;
  return kept < kMostHits;
}

float signed_byte(uint bits) { return float(int(bits) >> 24); }

// The quaternion of a surfel word `w`, and the first row of S R: the normal over its deviation.
#define NORMAL_ROW(w)                                            \
  precise float step = 0.70711f / 127.0f;                        \
  precise float qx = signed_byte(w.y << 24) * step;              \
  precise float qy = signed_byte(w.y << 16) * step;              \
  precise float qz = signed_byte(w.y << 8) * step;               \
  precise float xx = qx * qx;                                    \
  precise float yy = qy * qy;                                    \
  precise float zz = qz * qz;                                    \
  precise float rest = 1.0f - xx - yy - zz;                      \
  precise float qw = root_of(max(0.0f, rest));                   \
  precise float xy = qx * qy;                                    \
  precise float xz = qx * qz;                                    \
  precise float wy = qw * qy;                                    \
  precise float wz = qw * qz;                                    \
  float inverse0 = map.inverse_thickness[w.x >> 30];             \
  precise float m0x = (1.0f - 2.0f * (yy + zz)) * inverse0;      \
  precise float m0y = 2.0f * (xy + wz) * inverse0;               \
  precise float m0z = 2.0f * (xz - wy) * inverse0;

/// |e0 . d| of a surfel.
float cosine_of(uint word) {
  uvec2 w = word_at(word);
  NORMAL_ROW(w)
  precise float v = m0x * s.ray.x + m0y * s.ray.y + m0z * s.ray.z;
  precise float cosine = abs(v) * map.thickness[w.x >> 30];
  return cosine;
}

/// The return: weighted means over the window, in whole steps.
DeviceHit end_way() {
  DeviceHit hit;
  hit.range = s.is_lossless ? kNothing : kTooMany;
  hit.cosine = 0.0f;
  hit.surfel = 0u;
  if (s.first == kNever || !s.is_lossless) return hit;
  precise float end = s.first + map.window;
  int weight = 0;
  int depth = 0;
  int cosine = 0;
  int largest = -1;
  for (int i = 0; i < s.hits; ++i) {
    float t = hit_t[i];
    if (!(t >= s.first && t <= end)) continue;
    int whole = hit_weight[i];
    uint word = hit_word[i];
    precise float behind = (t - s.first) * map.shares_per_metre;
    precise float turned = cosine_of(word) * 4096.0f;
    weight += whole >> 8;
    depth += (whole >> 8) * int(behind);
    cosine += (whole >> 8) * int(turned);
    if (whole > largest || (whole == largest && word < hit.surfel)) {
      largest = whole;
      hit.surfel = word;
    }
  }
  precise float total = float(weight) * 4096.0f;
  precise float range = s.first + divided(float(depth), total) * map.window;
  hit.range = range;
  hit.cosine = min(1.0f, divided(float(cosine), total));
  return hit;
}

// ---- the way down

/// The child in a lane of a node: where it is, and kInner or how many surfels a leaf has. Inner ones
/// are consecutive, and so are the words of leaves. `second`: 16 to 31 of the node's bytes.
uvec2 child_in(uvec4 second, uint lane) {
  uint shift = 8u * (lane & 3u);
  uint before = (1u << shift) - 1u;
  uint own = ((lane >= 4u ? second.w : second.z) >> shift) & 255u;
  uint meta0 = lane >= 4u ? second.z : second.z & before;  // of the lanes before
  uint meta1 = lane >= 4u ? second.w & before : 0u;
  if (own == 0x80u) {
    uint inner = uint(bitCount(meta0 & 0x80808080u) + bitCount(meta1 & 0x80808080u));
    return uvec2(second.x + inner, kInner);
  }
  // a leaf of n surfels has n + 1 words
  uint c0 = meta0 & 0x7f7f7f7fu;
  uint c1 = meta1 & 0x7f7f7f7fu;
  uint n = c0 + (((c0 + 0x7f7f7f7fu) >> 7) & 0x01010101u) + c1 +
           (((c1 + 0x7f7f7f7fu) >> 7) & 0x01010101u);
  return uvec2(second.y + ((n * 0x01010101u) >> 24), own);
}

void take_child(uvec4 second, uint lane) {
  uvec2 child = child_in(second, lane);
  s.index = child.x;
  s.next = child.y;
}

/// Takes the nearest child that waits before the end, if any.
void pop() {
  s.next = kDone;
  while (s.next == kDone && s.depth > 0) {
    s.depth -= 1;
    uvec2 entry = stack[s.depth];
    if (uintBitsToFloat(entry.x & 0xfffffff8u) <= s.end) {
      take_child(node_at(5u * entry.y + 1u), entry.x & 7u);
    }
  }
}

void push(uint key) {
  if (key == kNowhere) return;
  if (s.depth == kMostEntries) {
    s.is_lossless = false;
    return;
  }
  stack[s.depth] = uvec2(key, s.index);
  s.depth += 1;
}

float inverse_of(float d) {
  // a zero would make 0 * inf; a tiny slope reaches as far
  return 1.0f / (abs(d) > 1e-12f ? d : (d < 0.0f ? -1e-12f : 1e-12f));
}

void start_way(DeviceRay ray) {
  s.ray = ray;
  s.start_x = float(ray.voxel_x) * map.r + ray.rest_x;
  s.start_y = float(ray.voxel_y) * map.r + ray.rest_y;
  s.start_z = float(ray.voxel_z) * map.r + ray.rest_z;
  s.inverse_x = inverse_of(ray.x);
  s.inverse_y = inverse_of(ray.y);
  s.inverse_z = inverse_of(ray.z);
  s.end = ray.range_max;
  s.first = kNever;
  s.nearest = kNever;
  s.total = 0;
  s.hits = 0;
  s.depth = 0;
  s.next = map.node_count > 0u ? kInner : kDone;
  s.index = 0u;
  s.is_lossless = true;
}

#define SORT2(a, b)      \
  {                      \
    uint low = min(a, b); \
    b = max(a, b);       \
    a = low;             \
  }

// 32768 + byte k of w: the byte lies in the middle of a float's mantissa. With planes' offsets less
// 32768 steps a plane costs this and a multiply-add, right to 1/512 of a step.
#define PLANE(w, k) uintBitsToFloat(0x47000000u | (bitfieldExtract(w, 8 * k, 8) << 8))

// Where a ray enters a child before its end, the lane in the low three bits; else kNowhere.
// Distances are not negative: their bits sort as they do.
#define CHILD_KEY(key, lane, k, meta, nx, ny, nz, fx, fy, fz)                        \
  {                                                                                  \
    float enter = max(max(PLANE(nx, k) * bx + ax, PLANE(ny, k) * by + ay),           \
                      max(PLANE(nz, k) * bz + az, 0.0f));                            \
    float leave = min(min(PLANE(fx, k) * bx + ux, PLANE(fy, k) * by + uy),           \
                      min(PLANE(fz, k) * bz + uz, s.end));                           \
    key = enter <= leave && (meta & (255u << (8 * k))) != 0u                         \
              ? (floatBitsToUint(enter) & 0xfffffff8u) | lane                        \
              : kNowhere;                                                            \
  }

/// From a node to the nearest of its children that the ray enters.
void step_node() {
  uint at = 5u * s.index;
  uvec4 q0 = node_at(at);
  uvec4 q1 = node_at(at + 1u);
  uvec4 q2 = node_at(at + 2u);
  uvec4 q3 = node_at(at + 3u);
  uvec4 q4 = node_at(at + 4u);
  bool from_low_x = s.inverse_x >= 0.0f;
  bool from_low_y = s.inverse_y >= 0.0f;
  bool from_low_z = s.inverse_z >= 0.0f;
  float scale = uintBitsToFloat(q0.w);
  float bx = scale * s.inverse_x;
  float by = scale * s.inverse_y;
  float bz = scale * s.inverse_z;
  float mx = (uintBitsToFloat(q0.x) - s.start_x) * s.inverse_x - 32768.0f * bx;
  float my = (uintBitsToFloat(q0.y) - s.start_y) * s.inverse_y - 32768.0f * by;
  float mz = (uintBitsToFloat(q0.z) - s.start_z) * s.inverse_z - 32768.0f * bz;
  // boxes are wider by 1/256 of a step for what that rounds
  float ax = mx - abs(bx) * 0.00390625f;
  float ay = my - abs(by) * 0.00390625f;
  float az = mz - abs(bz) * 0.00390625f;
  float ux = mx + abs(bx) * 0.00390625f;
  float uy = my + abs(by) * 0.00390625f;
  float uz = mz + abs(bz) * 0.00390625f;
  // planes by axis, near and far, four lanes each
  uint nx0 = from_low_x ? q2.x : q3.z;
  uint nx1 = from_low_x ? q2.y : q3.w;
  uint fx0 = from_low_x ? q3.z : q2.x;
  uint fx1 = from_low_x ? q3.w : q2.y;
  uint ny0 = from_low_y ? q2.z : q4.x;
  uint ny1 = from_low_y ? q2.w : q4.y;
  uint fy0 = from_low_y ? q4.x : q2.z;
  uint fy1 = from_low_y ? q4.y : q2.w;
  uint nz0 = from_low_z ? q3.x : q4.z;
  uint nz1 = from_low_z ? q3.y : q4.w;
  uint fz0 = from_low_z ? q4.z : q3.x;
  uint fz1 = from_low_z ? q4.w : q3.y;
  uint key0;
  uint key1;
  uint key2;
  uint key3;
  uint key4;
  uint key5;
  uint key6;
  uint key7;
  CHILD_KEY(key0, 0u, 0, q1.z, nx0, ny0, nz0, fx0, fy0, fz0)
  CHILD_KEY(key1, 1u, 1, q1.z, nx0, ny0, nz0, fx0, fy0, fz0)
  CHILD_KEY(key2, 2u, 2, q1.z, nx0, ny0, nz0, fx0, fy0, fz0)
  CHILD_KEY(key3, 3u, 3, q1.z, nx0, ny0, nz0, fx0, fy0, fz0)
  CHILD_KEY(key4, 4u, 0, q1.w, nx1, ny1, nz1, fx1, fy1, fz1)
  CHILD_KEY(key5, 5u, 1, q1.w, nx1, ny1, nz1, fx1, fy1, fz1)
  CHILD_KEY(key6, 6u, 2, q1.w, nx1, ny1, nz1, fx1, fy1, fz1)
  CHILD_KEY(key7, 7u, 3, q1.w, nx1, ny1, nz1, fx1, fy1, fz1)
  // a sorting network of eight
  SORT2(key0, key2) SORT2(key1, key3) SORT2(key4, key6) SORT2(key5, key7)
  SORT2(key0, key4) SORT2(key1, key5) SORT2(key2, key6) SORT2(key3, key7)
  SORT2(key0, key1) SORT2(key2, key3) SORT2(key4, key5) SORT2(key6, key7)
  SORT2(key2, key4) SORT2(key3, key5)
  SORT2(key1, key4) SORT2(key3, key6)
  SORT2(key1, key2) SORT2(key3, key4) SORT2(key5, key6)
  if (key1 != kNowhere) {  // seldom more than two or three
    if (key3 != kNowhere) {
      push(key7);
      push(key6);
      push(key5);
      push(key4);
      push(key3);
    }
    push(key2);
    push(key1);
  }
  if (key0 != kNowhere) {
    take_child(q1, key0 & 7u);
  } else {
    pop();
  }
}

/// Whether a ray may hit the surfel `w` of a leaf whose corner is so far from its start.
bool is_near(uvec2 w, float corner_x, float corner_y, float corner_z) {
  float x = (float(w.x & 1023u) + 0.5f) * map.position_step + corner_x;
  float y = (float((w.x >> 10) & 1023u) + 0.5f) * map.position_step + corner_y;
  float z = (float((w.x >> 20) & 1023u) + 0.5f) * map.position_step + corner_z;
  float along = s.ray.x * x + s.ray.y * y + s.ray.z * z;
  float px = x - along * s.ray.x;
  float py = y - along * s.ray.y;
  float pz = z - along * s.ray.z;
  // s2^2, or s0^2 of the thickness classes that can lie above it
  float widest = uintBitsToFloat((w.y >> 27) * 0x288000u + 0x3b6bedfau) * map.r_squared;
  uint thickness = w.x >> 30;
  if (thickness >= 2u) widest = max(widest, thickness == 2u ? map.widest2 : map.widest3);
  return px * px + py * py + pz * pz <= widest * (map.support_squared * 1.01f);
}

/// Adds a hit. False if there is no room for it.
bool add_hit(float t, int weight, uint word) {
  if (s.hits == kMostHits && !make_room()) return false;
  hit_t[s.hits] = t;
  hit_weight[s.hits] = weight;
  hit_word[s.hits] = word;
  s.hits += 1;
  s.total += weight;
  s.nearest = min(s.nearest, t);
  return true;
}

/// The surfels of a leaf, and on.
void step_leaf() {
  uint leaf = s.index;
  uint count = s.next;
  uvec2 header = word_at(leaf);
  uint leaf_x = header.x & 0xfffffu;
  uint leaf_y = (header.x >> 20) | ((header.y & 0xffu) << 12);
  uint leaf_z = (header.y >> 8) & 0xfffffu;
  precise float corner_x = float(int(leaf_x) - s.ray.voxel_x) * map.r - s.ray.rest_x;
  precise float corner_y = float(int(leaf_y) - s.ray.voxel_y) * map.r - s.ray.rest_y;
  precise float corner_z = float(int(leaf_z) - s.ray.voxel_z) * map.r - s.ray.rest_z;
  // many surfels are passed at a distance
  uint near_by = 0u;
  for (uint i = 0u; i < count; ++i) {
    if (is_near(word_at(leaf + 1u + i), corner_x, corner_y, corner_z)) near_by |= 1u << i;
  }
  bool any = false;
  while (near_by != 0u) {
    uint word = leaf + 1u + uint(findLSB(near_by));
    near_by &= near_by - 1u;
    uvec2 w = word_at(word);
    precise float x = (float(w.x & 1023u) + 0.5f) * map.position_step + corner_x;
    precise float y = (float((w.x >> 10) & 1023u) + 0.5f) * map.position_step + corner_y;
    precise float z = (float((w.x >> 20) & 1023u) + 0.5f) * map.position_step + corner_z;
    NORMAL_ROW(w)
    precise float yz = qy * qz;
    precise float wx = qw * qx;
    float inverse2 = map.inverse_spread[w.y >> 27];
    precise float inverse1 = inverse2 * map.inverse_ratio[(w.y >> 24) & 7u];
    precise float m1x = 2.0f * (xy - wz) * inverse1;
    precise float m1y = (1.0f - 2.0f * (xx + zz)) * inverse1;
    precise float m1z = 2.0f * (yz + wx) * inverse1;
    precise float m2x = 2.0f * (xz + wy) * inverse2;
    precise float m2y = 2.0f * (yz - wx) * inverse2;
    precise float m2z = (1.0f - 2.0f * (xx + yy)) * inverse2;
    // u = S R (p - o), v = S R d; t = u.v / v.v; m^2 = |u - t v|^2
    precise float ux = m0x * x + m0y * y + m0z * z;
    precise float uy = m1x * x + m1y * y + m1z * z;
    precise float uz = m2x * x + m2y * y + m2z * z;
    precise float vx = m0x * s.ray.x + m0y * s.ray.y + m0z * s.ray.z;
    precise float vy = m1x * s.ray.x + m1y * s.ray.y + m1z * s.ray.z;
    precise float vz = m2x * s.ray.x + m2y * s.ray.y + m2z * s.ray.z;
    precise float along = ux * vx + uy * vy + uz * vz;
    precise float length2 = vx * vx + vy * vy + vz * vz;
    precise float t = divided(along, length2);
    precise float a0 = ux - t * vx;
    precise float a1 = uy - t * vy;
    precise float a2 = uz - t * vz;
    precise float m2 = a0 * a0 + a1 * a1 + a2 * a2;
    if (!(m2 < map.support_squared && t >= 0.0f && t <= s.end)) continue;
    precise float share = 1.0f - m2 * map.inverse_support;
    precise float weight = map.weight_scale * share * share;
    if (!add_hit(t, int(weight), word)) {
      s.is_lossless = false;
      s.next = kDone;
      return;
    }
    any = true;
  }
  // if the nearest hit begins the surface, farther ones cannot move it
  if (any && s.nearest < s.first && s.total >= map.tau) shorten();
  pop();
}

#undef NORMAL_ROW
#undef CHILD_KEY
#undef PLANE
#undef SORT2
