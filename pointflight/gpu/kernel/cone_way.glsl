// The way of a wide beam down the hierarchy, and which surfels it touches. After cone.glsl.

/// Takes the nearest child that waits before the end, if any; looks if it lies far enough.
void pop_cone() {
  c.next = kDone;
  while (c.next == kDone && c.depth > 0) {
    c.depth -= 1;
    uvec2 entry = cone_stack[c.depth];
    float depth = uintBitsToFloat(entry.x & 0xfffffff8u);
    if (depth > c.look_behind) look();
    if (depth > c.deepest * 1.0001f) continue;
    uvec2 child = child_in(node_at(5u * entry.y + 1u), entry.x & 7u);
    c.index = child.x;
    c.next = child.y;
  }
}

/// Pushes children in order: farther ones first, as they come out of a node's lanes.
void push_cone(uint key) {
  if (c.depth == kMostEntries) {
    c.is_lossless = false;
    return;
  }
  int at = c.depth;
  c.depth += 1;
  // by insertion among those of the same node
  while (at > 0 && cone_stack[at - 1].y == c.index && cone_stack[at - 1].x < key) {
    cone_stack[at] = cone_stack[at - 1];
    at -= 1;
  }
  cone_stack[at] = uvec2(key, c.index);
}

float box_byte(uint low, uint high, uint lane) {
  return float(((lane >= 4u ? high : low) >> (8u * (lane & 3u))) & 255u);
}

void step_cone_node() {
  uint at = 5u * c.index;
  uvec4 q0 = node_at(at);
  uvec4 q1 = node_at(at + 1u);
  uvec4 q2 = node_at(at + 2u);
  uvec4 q3 = node_at(at + 3u);
  uvec4 q4 = node_at(at + 4u);
  float scale = uintBitsToFloat(q0.w);
  float o_x = uintBitsToFloat(q0.x);
  float o_y = uintBitsToFloat(q0.y);
  float o_z = uintBitsToFloat(q0.z);
  float ou = pick(o_x, o_y, o_z, c.u) - c.start_u;
  float ov = pick(o_x, o_y, o_z, c.v) - c.start_v;
  float ow = pick(o_x, o_y, o_z, c.w) - c.start_w;
  float room = 0.02f * scale + 1e-6f * (abs(c.start_u) + abs(c.start_v) + abs(c.start_w));
  uint lu0 = pick_word(q2.x, q2.z, q3.x, c.u);
  uint lu1 = pick_word(q2.y, q2.w, q3.y, c.u);
  uint hu0 = pick_word(q3.z, q4.x, q4.z, c.u);
  uint hu1 = pick_word(q3.w, q4.y, q4.w, c.u);
  uint lv0 = pick_word(q2.x, q2.z, q3.x, c.v);
  uint lv1 = pick_word(q2.y, q2.w, q3.y, c.v);
  uint hv0 = pick_word(q3.z, q4.x, q4.z, c.v);
  uint hv1 = pick_word(q3.w, q4.y, q4.w, c.v);
  uint lw0 = pick_word(q2.x, q2.z, q3.x, c.w);
  uint lw1 = pick_word(q2.y, q2.w, q3.y, c.w);
  uint hw0 = pick_word(q3.z, q4.x, q4.z, c.w);
  uint hw1 = pick_word(q3.w, q4.y, q4.w, c.w);
  bool is_forward = c.forward > 0.0f;
  for (uint lane = 0u; lane < 8u; ++lane) {
    uint meta = ((lane >= 4u ? q1.w : q1.z) >> (8u * (lane & 3u))) & 255u;
    if (meta == 0u) continue;
    float low_u = ou + scale * box_byte(lu0, lu1, lane) - room;
    float high_u = ou + scale * box_byte(hu0, hu1, lane) + room;
    float low_v = ov + scale * box_byte(lv0, lv1, lane) - room;
    float high_v = ov + scale * box_byte(hv0, hv1, lane) + room;
    float low_w = ow + scale * box_byte(lw0, lw1, lane) - room;
    float high_w = ow + scale * box_byte(hw0, hw1, lane) + room;
    float middle_w = 0.5f * (is_forward ? low_w + high_w : -low_w - high_w);
    float half_w = 0.5f * (high_w - low_w);
    float enter = max(0.0f, middle_w - half_w);
    float leave = middle_w + half_w;
    // the rectangle by which surfels are chosen (`touch`), of the box: no surfel is missed for it
    float beside_u = abs(0.5f * (low_u + high_u) - c.at_u * middle_w);
    float beside_v = abs(0.5f * (low_v + high_v) - c.at_v * middle_w);
    float reach_u = 0.5f * (high_u - low_u) + abs(c.at_u) * half_w + c.wide_u * leave;
    float reach_v = 0.5f * (high_v - low_v) + abs(c.at_v) * half_w + c.wide_v * leave;
    if (leave < 0.0f || enter > c.deepest * 1.0001f || beside_u > reach_u || beside_v > reach_v) {
      continue;
    }
    push_cone((floatBitsToUint(enter) & 0xfffffff8u) | lane);
  }
  pop_cone();
}

/// The surfel `word` of a leaf whose corner lies so far from the beam's start, into the list if the
/// beam touches it.
void touch(uint word, float corner_x, float corner_y, float corner_z) {
  uvec2 q = word_at(word);
  precise float x = (float(q.x & 1023u) + 0.5f) * map.position_step + corner_x;
  precise float y = (float((q.x >> 10) & 1023u) + 0.5f) * map.position_step + corner_y;
  precise float z = (float((q.x >> 20) & 1023u) + 0.5f) * map.position_step + corner_z;
  precise float depth_seen = pick(x, y, z, c.w) * c.forward;
  precise float u_seen = pick(x, y, z, c.u) - c.at_u * depth_seen;
  precise float v_seen = pick(x, y, z, c.v) - c.at_v * depth_seen;
  precise float variance2 = uintBitsToFloat((q.y >> 27) * 0x288000u + 0x3b6bedfau) * map.r_squared;
  uint thickness = q.x >> 30;
  // many are passed at a distance
  float widest = variance2;
  if (thickness >= 2u) widest = max(widest, thickness == 2u ? map.widest2 : map.widest3);
  float reach = 1.02f * sqrt(widest * map.support_squared);
  float far = depth_seen + reach;
  if (abs(u_seen) > reach * (1.0f + abs(c.at_u)) + 1.01f * c.wide_u * max(far, 0.0f) + 1e-5f) return;
  if (abs(v_seen) > reach * (1.0f + abs(c.at_v)) + 1.01f * c.wide_v * max(far, 0.0f) + 1e-5f) return;
  precise float step = 0.70711f / 127.0f;
  precise float qx = signed_byte(q.y << 24) * step;
  precise float qy = signed_byte(q.y << 16) * step;
  precise float qz = signed_byte(q.y << 8) * step;
  precise float xx = qx * qx;
  precise float yy = qy * qy;
  precise float zz = qz * qz;
  precise float rest = 1.0f - xx - yy - zz;
  precise float qw = root_of(max(0.0f, rest));
  precise float xy = qx * qy;
  precise float xz = qx * qz;
  precise float yz = qy * qz;
  precise float wx = qw * qx;
  precise float wy = qw * qy;
  precise float wz = qw * qz;
  float inverse0 = map.inverse_thickness[thickness];
  float inverse2 = map.inverse_spread[q.y >> 27];
  precise float inverse1 = inverse2 * map.inverse_ratio[(q.y >> 24) & 7u];
  precise float m0x = (1.0f - 2.0f * (yy + zz)) * inverse0;
  precise float m0y = 2.0f * (xy + wz) * inverse0;
  precise float m0z = 2.0f * (xz - wy) * inverse0;
  precise float m1x = 2.0f * (xy - wz) * inverse1;
  precise float m1y = (1.0f - 2.0f * (xx + zz)) * inverse1;
  precise float m1z = 2.0f * (yz + wx) * inverse1;
  precise float m2x = 2.0f * (xz + wy) * inverse2;
  precise float m2y = 2.0f * (yz - wx) * inverse2;
  precise float m2z = (1.0f - 2.0f * (xx + yy)) * inverse2;
  float s0 = map.thickness[thickness];
  float ratio = map.ratio[(q.y >> 24) & 7u];
  precise float square0 = s0 * s0;
  precise float square1 = variance2 * ratio * ratio;
  // axes as long as the deviations, by u, v, w
#define AXIS(j, square)                                                   \
  precise float a##j##u = pick(m##j##x, m##j##y, m##j##z, c.u) * square;  \
  precise float a##j##v = pick(m##j##x, m##j##y, m##j##z, c.v) * square;  \
  precise float a##j##w = pick(m##j##x, m##j##y, m##j##z, c.w) * square;
  AXIS(0, square0)
  AXIS(1, square1)
  AXIS(2, variance2)
#undef AXIS
  precise float cov_uu = a0u * a0u + a1u * a1u + a2u * a2u;
  precise float cov_vv = a0v * a0v + a1v * a1v + a2v * a2v;
  precise float cov_ww = a0w * a0w + a1w * a1w + a2w * a2w;
  precise float cov_uv = a0u * a0v + a1u * a1v + a2u * a2v;
  precise float cov_uw = a0u * a0w + a1u * a1w + a2u * a2w;
  precise float cov_vw = a0v * a0w + a1v * a1w + a2v * a2w;
  // the rectangle in which it may be touched
  precise float reach_u = root_of(cov_uu) * map.leaf_reach;
  precise float reach_v = root_of(cov_vv) * map.leaf_reach;
  precise float reach_w = root_of(cov_ww) * map.leaf_reach;
  precise float farthest = depth_seen + reach_w;
  precise float beside_u = reach_u + abs(c.at_u) * reach_w + c.wide_u * farthest;
  precise float beside_v = reach_v + abs(c.at_v) * reach_w + c.wide_v * farthest;
  if (!(abs(u_seen) <= beside_u && abs(v_seen) <= beside_v)) return;
  precise float ww = cov_ww;
  precise float uw = cov_uw * c.forward;
  precise float vw = cov_vw * c.forward;
  precise float p = uw - c.at_u * ww;
  precise float q2 = vw - c.at_v * ww;
  precise float uu = cov_uu - c.at_u * (uw + p);
  precise float vv = cov_vv - c.at_v * (vw + q2);
  precise float uv = cov_uv - c.at_u * vw - c.at_v * p;
  precise float det = uu * vv - uv * uv;
  float per_det = divided(1.0f, det);
  precise float iuu = vv * per_det;
  precise float iuv = 0.0f - uv * per_det;
  precise float ivv = uu * per_det;
  precise float hu = iuu * u_seen + iuv * v_seen;
  precise float hv = iuv * u_seen + ivv * v_seen;
  precise float m2 = u_seen * hu + v_seen * hv;
  precise float depth = depth_seen - (p * hu + q2 * hv);
  float inverse = divided(1.0f, depth);
  precise float inverse_u = 0.0f - (p * iuu + q2 * iuv) * inverse;
  precise float inverse_v = 0.0f - (p * iuv + q2 * ivv) * inverse;
  precise float squared = depth_seen * depth_seen;
  precise float mean = squared * (iuu * c.half_uu + iuv * c.uv + ivv * c.half_vv);
  precise float product = squared * squared * per_det * c.det;
  precise float inner = max(0.0f, mean * mean - product);
  precise float outer = mean + root_of(inner);
  float longer = root_of(outer);
  precise float space = map.cone_radius * longer;
  precise float limit = map.support + space;
  precise float in_beam = inverse + c.wide_u * abs(inverse_u) + c.wide_v * abs(inverse_v);
  precise float begin = depth_seen - reach_w;
  float nearest = min(in_beam, divided(1.0f, max(begin, 1e-6f)));
  precise float limit2 = limit * limit;
  precise float reached = nearest * c.deepest;
  if (!(m2 < limit2 && 1.0f <= reached)) return;
  if (c.count == kMostTouched) {
    c.is_lossless = false;
    return;
  }
  precise float twice = 0.0f - (depth_seen + depth_seen);
  precise float of_u = twice * hu;
  precise float of_v = twice * hv;
  precise float of_uu = squared * iuu;
  precise float of_uv = squared * (iuv + iuv);
  precise float of_vv = squared * ivv;
  precise float nu = pick(m0x, m0y, m0z, c.u) * s0;
  precise float nv = pick(m0x, m0y, m0z, c.v) * s0;
  precise float nw = pick(m0x, m0y, m0z, c.w) * s0;
  precise float cosine = (nu * c.at_u + nv * c.at_v + nw * c.forward) * c.dw;
  precise float cosine_steps = abs(cosine) * kConeCosineSteps;
  precise float solid = map.solid_support + space;
  precise float solid2 = solid * solid;
  int row = c.count;
  set_touched(row, kAtM2, m2);
  set_touched(row, kAtM2 + 1u, of_u);
  set_touched(row, kAtM2 + 2u, of_v);
  set_touched(row, kAtM2 + 3u, of_uu);
  set_touched(row, kAtM2 + 4u, of_uv);
  set_touched(row, kAtM2 + 5u, of_vv);
  set_touched(row, kAtInverse, inverse);
  set_touched(row, kAtInverse + 1u, inverse_u);
  set_touched(row, kAtInverse + 2u, inverse_v);
  set_touched(row, kAtCosine, whole(cosine_steps));
  set_touched(row, kAtNearest, nearest);
  set_touched(row, kAtSolid, m2 < solid2 ? 1.0f : 0.0f);
  set_touched(row, kAtWord, uintBitsToFloat(word));
  c.count += 1;
  if (m2 < map.support_squared) c.cover += soft_weight(m2);
  c.farthest = max(c.farthest, depth);
}

void step_cone_leaf() {
  uint leaf = c.index;
  uint count = c.next;
  uvec2 header = word_at(leaf);
  uint leaf_x = header.x & 0xfffffu;
  uint leaf_y = (header.x >> 20) | ((header.y & 0xffu) << 12);
  uint leaf_z = (header.y >> 8) & 0xfffffu;
  precise float corner_x = float(int(leaf_x) - c.ray.voxel_x) * map.r - c.ray.rest_x;
  precise float corner_y = float(int(leaf_y) - c.ray.voxel_y) * map.r - c.ray.rest_y;
  precise float corner_z = float(int(leaf_z) - c.ray.voxel_z) * map.r - c.ray.rest_z;
  for (uint i = 0u; i < count; ++i) touch(leaf + 1u + i, corner_x, corner_y, corner_z);
  if (c.cover >= kLookAtCover) c.look_behind = c.farthest + map.window;
  pop_cone();
}
