#version 450
// Rays through the map: one an invocation, or, with PERSISTENT, subgroups that stay and whose idle
// lanes take the next rays: ways differ in length.
#extension GL_GOOGLE_include_directive : require
#if PERSISTENT
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require
#endif

#include "layout.glsl"
#include "exact.glsl"

layout(local_size_x = 128) in;

/// Of rays that a subgroup takes at a time, so many times at most; 0: for as long as there are any.
layout(constant_id = 0) const uint kMostChunks = 0u;

layout(std430, set = 0, binding = 3) restrict readonly buffer Given { uint given[]; };
layout(std430, set = 0, binding = 4) restrict writeonly buffer Results { uint results[]; };
layout(std430, set = 0, binding = 5) restrict buffer Counter { uint taken; };
layout(std430, set = 0, binding = 6) restrict readonly buffer Beams { DeviceBeam beams[]; };
layout(push_constant) uniform Call { DeviceCall call; };

#include "map.glsl"
#include "aim.glsl"
#include "trace.glsl"

/// Ends the way of ray `i`.
void finish(uint i) {
  DeviceHit hit = end_way();
  uint place = place_of(i);
  if (call.wants_ranges != 0u) {
    results[place] = floatBitsToUint(hit.range);
    return;
  }
  results[3u * place] = floatBitsToUint(hit.range);
  results[3u * place + 1u] = floatBitsToUint(hit.cosine);
  results[3u * place + 2u] = hit.surfel;
}

#if PERSISTENT
// Lanes that are through take the next rays once a quarter of the subgroup is, and leaves wait
// until half of it has one.
void main() {
  uint few = max(1u, gl_SubgroupSize / 4u);
  uint many = max(1u, gl_SubgroupSize / 2u);
  uint share = call.count / (gl_NumWorkGroups.x * gl_NumSubgroups * 4u);
  uint chunk = min(256u, max(gl_SubgroupSize, share));
  bool is_flying = false;
  uint slot = 0u;
  uint next = 0u;
  uint stop = 0u;  // of the subgroup's chunk
  uint chunks = 0u;
  bool is_exhausted = false;
  s.next = kDone;
  for (;;) {
    if (is_flying && s.next == kDone) {
      finish(slot);
      is_flying = false;
    }
    uvec4 idle = subgroupBallot(!is_flying);
    uint idles = subgroupBallotBitCount(idle);
    if ((!is_exhausted || next < stop) && idles >= few) {
      if (next == stop) {
        uint first = 0u;
        if (subgroupElect()) first = atomicAdd(taken, chunk);
        next = subgroupBroadcastFirst(first);
        stop = min(next + chunk, call.count);
        if (next >= call.count) {
          is_exhausted = true;
          next = stop;
        }
        chunks += 1u;
        if (chunks == kMostChunks) is_exhausted = true;
      }
      uint ray = next + subgroupBallotExclusiveBitCount(idle);
      if (!is_flying && ray < stop) {
        slot = ray;
        start_way(ray_of(ray));
        is_flying = true;
      }
      next = min(next + idles, stop);
    }
    if (!subgroupAny(is_flying)) {
      if (is_exhausted && next == stop) return;
      continue;
    }
    for (;;) {
      if (is_flying && s.next == kInner) step_node();
      uint inner = subgroupBallotBitCount(subgroupBallot(is_flying && s.next == kInner));
      uint done = subgroupBallotBitCount(subgroupBallot(!is_flying || s.next == kDone));
      bool wants_rays = (!is_exhausted || next < stop) && done >= few;
      if (inner == 0u || gl_SubgroupSize - inner - done >= many || wants_rays) break;
    }
    if (is_flying && s.next != kInner && s.next != kDone) step_leaf();
  }
}
#else
void main() {
  uint ray = gl_GlobalInvocationID.x;
  if (ray >= call.count) return;
  start_way(ray_of(ray));
  while (s.next != kDone) {
    while (s.next == kInner) step_node();
    if (s.next != kDone) step_leaf();
  }
  finish(ray);
}
#endif
