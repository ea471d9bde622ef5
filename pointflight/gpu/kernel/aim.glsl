// Rays of aimed beams: multiplications and additions alone, the same as on the processor
// (render/internal/aim_kernel.cpp, where the formulas are said).
//
// GLSL and C++. Before it: layout.glsl, `call` (DeviceCall), `given` (uint words: aims first) and
// `beams` (DeviceBeam).

float given_float(uint word) { return uintBitsToFloat(given[word]); }

/// Between a pose's number at a word and the same one of the next pose.
float pose_number(uint word, bool is_rolling, float fraction) {
  float a = given_float(word);
  if (!is_rolling) return a;
  precise float between = a + fraction * (given_float(word + kPoseWords) - a);
  return between;
}

float inverse_root_near_one(float x) {
  precise float half_x = 0.5f * x;
  precise float y = 1.0f;
  for (int i = 0; i < 6; ++i) {
    precise float next = y * (1.5f - half_x * (y * y));
    y = next;
  }
  return y;
}

float inverse_near_one(float x) {
  precise float y = 1.0f;
  for (int i = 0; i < 5; ++i) {
    precise float next = y * (2.0f - x * y);
    y = next;
  }
  return y;
}

// v |q|^2 + w t + q x t with t = 2 q x v, into ox, oy, oz
#define TURN(ox, oy, oz, vx, vy, vz)                            \
  precise float ox##_t = 2.0f * (qy * vz - qz * vy);            \
  precise float oy##_t = 2.0f * (qz * vx - qx * vz);            \
  precise float oz##_t = 2.0f * (qx * vy - qy * vx);            \
  precise float ox = (square * vx + qw * ox##_t) + (qy * oz##_t - qz * oy##_t); \
  precise float oy = (square * vy + qw * oy##_t) + (qz * ox##_t - qx * oz##_t); \
  precise float oz = (square * vz + qw * oz##_t) + (qx * oy##_t - qy * ox##_t);

/// Of ray `i` of the call: a beam of its aim.
uint beam_of(uint i) { return i % call.beams; }

DeviceRay aimed_ray(uint i) {
  uint aim = (i / call.beams) * kAimWords;
  DeviceBeam beam = beams[beam_of(i)];
  bool is_rolling = given[aim + 8u] != 0u;
  uint pose = given[aim + 7u] + (is_rolling ? beam.piece * kPoseWords : 0u);
  float f = beam.fraction;
  float qx = pose_number(pose, is_rolling, f);
  float qy = pose_number(pose + 1u, is_rolling, f);
  float qz = pose_number(pose + 2u, is_rolling, f);
  float qw = pose_number(pose + 3u, is_rolling, f);
  precise float square = ((qx * qx + qy * qy) + qz * qz) + qw * qw;
  precise float dx = beam.direction_x;
  precise float dy = beam.direction_y;
  precise float dz = beam.direction_z;
  uint deviations = given[aim + 9u];
  if (deviations != kNowhere) {
    uint at = deviations + 2u * beam.number;
    float u = given_float(at);
    float v = given_float(at + 1u);
    float ax = beam.across_x;
    float ay = beam.across_y;
    precise float ex = dx + (u * ax - v * (dz * ay));
    precise float ey = dy + (u * ay + v * (dz * ax));
    precise float ez = dz + v * (dx * ay - dy * ax);
    precise float e2 = (ex * ex + ey * ey) + ez * ez;
    float scale = inverse_root_near_one(e2);
    dx = ex * scale;
    dy = ey * scale;
    dz = ez * scale;
  }
  TURN(x, y, z, dx, dy, dz)
  precise float length2 = (x * x + y * y) + z * z;
  float to_unit = inverse_root_near_one(length2);
  precise float shift_x = pose_number(pose + 4u, is_rolling, f);
  precise float shift_y = pose_number(pose + 5u, is_rolling, f);
  precise float shift_z = pose_number(pose + 6u, is_rolling, f);
  if (call.has_origins != 0u) {
    float inverse = inverse_near_one(square);
    TURN(from_x, from_y, from_z, beam.origin_x, beam.origin_y, beam.origin_z)
    shift_x = shift_x + from_x * inverse;
    shift_y = shift_y + from_y * inverse;
    shift_z = shift_z + from_z * inverse;
  }
  precise float rest_x = given_float(aim + 3u) + shift_x;
  precise float rest_y = given_float(aim + 4u) + shift_y;
  precise float rest_z = given_float(aim + 5u) + shift_z;
  precise float unit_x = x * to_unit;
  precise float unit_y = y * to_unit;
  precise float unit_z = z * to_unit;
  precise float range_max = given_float(aim + 6u) * beam.stretch;
  DeviceRay ray;
  ray.voxel_x = int(given[aim]);
  ray.voxel_y = int(given[aim + 1u]);
  ray.voxel_z = int(given[aim + 2u]);
  ray.rest_x = rest_x;
  ray.rest_y = rest_y;
  ray.rest_z = rest_z;
  ray.x = unit_x;
  ray.y = unit_y;
  ray.z = unit_z;
  ray.range_max = range_max;
  return ray;
}

/// What is horizontal across a beam of the call, in the world: `make_across`.
float across_x;
float across_y;
float across_z;
void aim_across(uint i) {
  uint aim = (i / call.beams) * kAimWords;
  DeviceBeam beam = beams[beam_of(i)];
  bool is_rolling = given[aim + 8u] != 0u;
  uint pose = given[aim + 7u] + (is_rolling ? beam.piece * kPoseWords : 0u);
  float qx = pose_number(pose, is_rolling, beam.fraction);
  float qy = pose_number(pose + 1u, is_rolling, beam.fraction);
  float qz = pose_number(pose + 2u, is_rolling, beam.fraction);
  float qw = pose_number(pose + 3u, is_rolling, beam.fraction);
  precise float square = ((qx * qx + qy * qy) + qz * qz) + qw * qw;
  float zero = 0.0f;
  TURN(x, y, z, beam.across_x, beam.across_y, zero)
  precise float length2 = (x * x + y * y) + z * z;
  float to_unit = inverse_root_near_one(length2);
  precise float unit_x = x * to_unit;
  precise float unit_y = y * to_unit;
  precise float unit_z = z * to_unit;
  across_x = unit_x;
  across_y = unit_y;
  across_z = unit_z;
}

#undef TURN

/// Ray `i` of a call that brings its rays.
DeviceRay given_ray(uint i) {
  uint at = 10u * i;
  DeviceRay ray;
  ray.voxel_x = int(given[at]);
  ray.voxel_y = int(given[at + 1u]);
  ray.voxel_z = int(given[at + 2u]);
  ray.rest_x = given_float(at + 3u);
  ray.rest_y = given_float(at + 4u);
  ray.rest_z = given_float(at + 5u);
  ray.x = given_float(at + 6u);
  ray.y = given_float(at + 7u);
  ray.z = given_float(at + 8u);
  ray.range_max = given_float(at + 9u);
  return ray;
}

DeviceRay ray_of(uint i) {
  if (call.beams == 0u) return given_ray(i);
  return aimed_ray(i);
}

/// Where the hit of ray `i` belongs: beams are in an order of their own.
uint place_of(uint i) {
  if (call.beams == 0u) return i;
  return i - beam_of(i) + beams[beam_of(i)].number;
}
