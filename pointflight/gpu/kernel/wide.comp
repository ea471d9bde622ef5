#version 450
// Wide beams through the map, one an invocation and then the next: what comes of each, and of those
// that want more sub-rays what 32 hit.
#extension GL_GOOGLE_include_directive : require

#include "layout.glsl"
#include "exact.glsl"

layout(local_size_x = 128) in;

layout(std430, set = 0, binding = 3) restrict readonly buffer Given { uint given[]; };
layout(std430, set = 0, binding = 4) restrict writeonly buffer Results { WideResult results[]; };
layout(std430, set = 0, binding = 5) restrict buffer Counter { uint taken; };
layout(std430, set = 0, binding = 6) restrict readonly buffer Beams { DeviceBeam beams[]; };
layout(std430, set = 0, binding = 7) restrict readonly buffer Tables { uint tables[]; };
layout(std430, set = 0, binding = 8) restrict readonly buffer Codes { uint codes[]; };
layout(std430, set = 0, binding = 9) restrict buffer Lists { float lists[]; };
layout(std430, set = 0, binding = 10) restrict writeonly buffer More { uint more[]; };
layout(push_constant) uniform Call { DeviceCall call; };

#include "map.glsl"
#include "aim.glsl"
#include "trace.glsl"

// the invocation's own list: neighbours' numbers lie side by side
float touched(int row, uint number) {
  return lists[(uint(row) * kTouchedNumbers + number) * call.threads + gl_GlobalInvocationID.x];
}
void set_touched(int row, uint number, float value) {
  lists[(uint(row) * kTouchedNumbers + number) * call.threads + gl_GlobalInvocationID.x] = value;
}

#include "cone.glsl"
#include "cone_way.glsl"
#include "cone_end.glsl"

/// The second level of a beam whose first left doubt.
WideResult take_second_level() {
  uint place = atomicAdd(taken, 1u);
  if (place >= call.most_more) return result_of(kLeftToProcessor);
  uint table = second_level();
  uint at = place * 3u * kSecondLevel;
  float nearest = kNever;
  for (uint i = 0u; i < kSecondLevel; ++i) {
    see_sub_ray(table_float(table + 2u * i), table_float(table + 2u * i + 1u));
    hit_sub_ray();
    more[at + i] = floatBitsToUint(sub_range);
    more[at + kSecondLevel + i] = floatBitsToUint(sub_cosine);
    more[at + 2u * kSecondLevel + i] = uint(sub_word);
    nearest = min(nearest, sub_range);
  }
  if (!c.is_lossless) return result_of(kLeftToProcessor);
  WideResult result = result_of(kMoreSubRays);
  result.surfel = place;
  result.sub_ray = 2u * ((table - kAtSecond) / (2u * kSecondLevel)) + (has_before(nearest) ? 1u : 0u);
  return result;
}

void main() {
  for (uint i = call.first + gl_GlobalInvocationID.x; i < call.until; i += call.threads) {
    aim_across(i);
    start_cone(aimed_ray(i), across_x, across_y, across_z, beams[beam_of(i)].number);
    see_eight();
    while (c.next != kDone) {
      while (c.next == kInner) step_cone_node();
      if (c.next != kDone) step_cone_leaf();
    }
    WideResult result = end_cone();
    if (result.kind == kMoreSubRays) result = take_second_level();
    results[place_of(i)] = result;
  }
}
