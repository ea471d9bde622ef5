#version 450
// The paper's way on a GPU (section IV.A): points are splatted into a depth image by atomic minima,
// those on planes with the depth at which a pixel's ray hits the plane. All operations are those of
// paper_kernel.cpp, so that images are the same bits; of points as near the first keeps the pixel.
#extension GL_GOOGLE_include_directive : require

#include "layout.glsl"
#include "paper_layout.glsl"
#include "exact.glsl"

layout(local_size_x = 128) in;

layout(std430, set = 0, binding = 0) restrict readonly buffer Image { PaperNumbers image; };
layout(std430, set = 0, binding = 1) restrict readonly buffer Points { PaperPoint points[]; };
layout(std430, set = 0, binding = 2) restrict readonly buffer Chunks { PaperChunk chunks[]; };
/// Cosines and sines of rows, then those of columns.
layout(std430, set = 0, binding = 3) restrict readonly buffer Angles { float angles[]; };
layout(std430, set = 0, binding = 4) restrict buffer Depths { uint depths[]; };  // as bits
/// Twice the point; 1 more if it keeps the pixel as the one that it projects to.
layout(std430, set = 0, binding = 5) restrict buffer Owners { uint owners[]; };
/// How many points of many pixels there are and were through by all invocations; then each one's
/// number and chunk.
layout(std430, set = 0, binding = 6) restrict buffer Large { uint larges; uint through; uint large[]; };
/// Planes of depths, cosines and intensities.
layout(std430, set = 0, binding = 7) restrict writeonly buffer Planes { float planes[]; };
layout(push_constant) uniform Call { PaperCall call; };

/// A point on its way into the image.
struct Splat {
  float x;
  float y;
  float z;
  float normal_x;
  float normal_y;
  float normal_z;
  float distance;
  float limit;  // cosine of theta_max times the distance
  float theta_max;
  float row_at;
  float column_at;
  float reach_squared;
  float offset;  // of its plane
  bool is_planar;
  int first_row;
  int last_row;
};
Splat p;

/// atan2, as paper_kernel.cpp has it.
float arc_tangent(float y, float x) {
  float ay = abs(y);
  float ax = abs(x);
  float small = min(ax, ay);
  float large = max(max(ax, ay), 1e-30f);
  precise float diagonal = 0.41421356f * large;
  bool is_steep = diagonal < small;
  precise float less = small - large;
  precise float more = small + large;
  float a = divided(is_steep ? less : small, is_steep ? more : large);
  precise float z = a * a;
  precise float tangent =
      (((8.05374449538e-2f * z - 1.38776856032e-1f) * z + 1.99777106478e-1f) * z -
       3.33329491539e-1f) * z * a + a;
  precise float steep = tangent + 0.78539816f;
  float to_axis = is_steep ? steep : tangent;
  precise float beside = 1.57079633f - to_axis;
  float from_x = ax < ay ? beside : to_axis;
  precise float behind = 3.14159265f - from_x;
  float upper = x < 0.0f ? behind : from_x;
  precise float lower = 0.0f - upper;
  return y < 0.0f ? lower : upper;
}

/// Sets up `p`. False if the point fills no pixel.
bool set_up(PaperPoint given, PaperChunk chunk) {
  float radius = abs(given.radius);
  precise float beside = 1.6f * radius;
  precise float x = chunk.corner_x + image.turn[0] * given.x + image.turn[1] * given.y + image.turn[2] * given.z;
  precise float y = chunk.corner_y + image.turn[3] * given.x + image.turn[4] * given.y + image.turn[5] * given.z;
  precise float z = chunk.corner_z + image.turn[6] * given.x + image.turn[7] * given.y + image.turn[8] * given.z;
  precise float across = x * x + y * y;
  precise float squared = across + z * z;
  float distance = root_of(squared);
  precise float farthest = image.range_max + radius;
  precise float top = distance * image.sin_high + beside;
  precise float bottom = distance * image.sin_low - beside;
  if (!(distance <= farthest && 1e-6f <= distance && z <= top && bottom <= z)) return false;
  if (image.is_narrow != 0u) {
    precise float left = image.left_x * x + image.left_y * y + beside;
    precise float right = image.right_x * x + image.right_y * y + beside;
    if (!(0.0f <= left && 0.0f <= right)) return false;
  }
  float sine = min(1.0f, divided(radius, distance));
  precise float sine2 = sine * sine;
  precise float theta = sine + 0.57079637050628662f * sine2 * sine;
  precise float cosine2 = 1.0f - sine2;
  precise float limit = root_of(cosine2) * distance;
  precise float reach2 = 4.0f * radius * radius;
  precise float azimuth = arc_tangent(y, x) - image.azimuth_min;
  precise float elevation = arc_tangent(z, root_of(across)) - image.elevation_min;
  p.row_at = divided(elevation, image.step);
  p.column_at = divided(azimuth, image.column_step);
  precise float nx = image.turn[0] * given.normal_x + image.turn[1] * given.normal_y + image.turn[2] * given.normal_z;
  precise float ny = image.turn[3] * given.normal_x + image.turn[4] * given.normal_y + image.turn[5] * given.normal_z;
  precise float nz = image.turn[6] * given.normal_x + image.turn[7] * given.normal_y + image.turn[8] * given.normal_z;
  precise float offset = x * nx + y * ny + z * nz;
  p.x = x;
  p.y = y;
  p.z = z;
  p.normal_x = nx;
  p.normal_y = ny;
  p.normal_z = nz;
  p.distance = distance;
  p.limit = limit;
  p.theta_max = theta;
  p.reach_squared = reach2;
  p.offset = offset;
  p.is_planar = given.radius < 0.0f;
  float reach = divided(theta, image.step);
  precise float half_up = p.row_at + 0.5f;
  precise float low = p.row_at - reach;
  precise float high = p.row_at + reach;
  float nearest = floor(half_up);
  p.first_row = int(min(nearest, ceil(low)));
  p.last_row = int(max(nearest, floor(high)));
  return p.last_row >= 0 && p.first_row < int(image.rows);
}

/// A pixel's ray against the splat: depth and cosine of incidence. False if it is not filled.
bool hits_pixel(int row, int column, out float depth, out float cosine) {
  uint r = 2u * uint(row);
  uint c = 2u * (image.rows + uint(column));
  precise float rx = angles[r] * angles[c];
  precise float ry = angles[r] * angles[c + 1u];
  float rz = angles[r + 1u];
  precise float along = rx * p.x + ry * p.y + rz * p.z;
  depth = p.distance;
  cosine = 1.0f;
  if (!(p.limit <= along)) return false;
  if (!p.is_planar) return true;
  precise float slope = p.normal_x * rx + p.normal_y * ry + p.normal_z * rz;
  cosine = abs(slope);
  // below, a plane's depth is ill-conditioned
  if (!(1e-3f <= cosine)) return true;
  depth = divided(p.offset, slope);
  precise float ex = depth * rx - p.x;
  precise float ey = depth * ry - p.y;
  precise float ez = depth * rz - p.z;
  precise float away = ex * ex + ey * ey + ez * ez;
  return away < p.reach_squared && 0.0f < depth;
}

/// The pixel (row, column) is `depth` away, if nothing is nearer.
void fill(int row, int column, float depth, uint owner) {
  uint at = uint(row) * image.columns + uint(column);
  if (call.task <= kDrawLarge) {
    atomicMin(depths[at], floatBitsToUint(depth));
  } else if (depths[at] == floatBitsToUint(depth)) {
    atomicMin(owners[at], owner);
  }
}

/// Every `step`th column from `first + lane` to `last`.
void fill_columns(int row, int first, int last, int lane, int step, uint owner) {
  for (int column = first + lane; column <= last; column += step) {
    float depth;
    float cosine;
    if (hits_pixel(row, column, depth, cosine)) fill(row, column, depth, owner);
  }
}

/// How many columns to each side of the splat a row may fill; more than half of all: all.
float half_width(int row) {
  float row_cos = angles[2u * uint(row)];
  float all = float(image.columns) + 1.0f;
  if (!(row_cos > 1e-3f)) return all;
  precise float wide = divided(p.theta_max, row_cos) * 1.2f;
  precise float wider = divided(wide, image.column_step) + 1.0f;
  return wider;
}

void fill_row(int row, int lane, int step, uint owner) {
  int columns = int(image.columns);
  float all = float(image.columns) + 1.0f;
  float wide = half_width(row);
  if (wide >= (image.is_full_turn != 0u ? 0.5f * all : all)) {
    fill_columns(row, 0, columns - 1, lane, step, owner);
    return;
  }
  precise float from = p.column_at - wide;
  precise float to = p.column_at + wide;
  int first = int(ceil(from));
  int last = int(floor(to));
  fill_columns(row, max(0, first), min(columns - 1, last), lane, step, owner);
  if (image.is_full_turn == 0u) return;
  if (first < 0) fill_columns(row, first + columns, columns - 1, lane, step, owner);
  if (last >= columns) fill_columns(row, 0, last - columns, lane, step, owner);
}

/// The pixel that the splat projects to, if it is smaller.
void fill_nearest(uint owner) {
  precise float row_at = p.row_at + 0.5f;
  precise float column_at = p.column_at + 0.5f;
  int row = int(floor(row_at));
  int column = int(floor(column_at));
  int columns = int(image.columns);
  if (image.is_full_turn != 0u) {
    if (column < 0) column += columns;
    if (column >= columns) column -= columns;
  }
  if (row < max(0, p.first_row) || row > min(int(image.rows) - 1, p.last_row)) return;
  if (column < 0 || column >= columns) return;
  uint r = 2u * uint(row);
  uint c = 2u * (image.rows + uint(column));
  precise float along = angles[r] * (angles[c] * p.x + angles[c + 1u] * p.y) + angles[r + 1u] * p.z;
  if (!(along < p.limit)) return;
  fill(row, column, p.distance, owner + 1u);
}

/// True if the splat is no work for one invocation.
bool is_large() {
  uint height = uint(min(int(image.rows) - 1, p.last_row) - max(0, p.first_row) + 1);
  float widest = max(half_width(max(0, p.first_row)), half_width(min(int(image.rows) - 1, p.last_row)));
  return float(height) * 2.0f * widest > float(kFewPixels);
}

/// The points of a chunk, one an invocation; those of many pixels are noted.
void draw_small() {
  uint number = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  if (number >= call.chunks || gl_LocalInvocationID.x >= chunks[number].count) return;
  uint point = chunks[number].first + gl_LocalInvocationID.x;
  if (!set_up(points[point], chunks[number])) return;
  if (is_large()) {
    if (call.task == kClaim) return;
    uint at = atomicAdd(larges, 1u);
    if (2u * at + 1u >= uint(large.length())) return;
    large[2u * at] = point;
    large[2u * at + 1u] = number;
    return;
  }
  int last = min(int(image.rows) - 1, p.last_row);
  for (int row = max(0, p.first_row); row <= last; ++row) fill_row(row, 0, 1, 2u * point);
  fill_nearest(2u * point);
}

/// Points of many pixels, a group each: eight rows of 16 columns at a time.
void draw_large() {
  uint count = min(larges, uint(large.length()) / 2u);
  uint done = 0u;
  int lane_row = int(gl_LocalInvocationID.x) / 16;
  int lane_column = int(gl_LocalInvocationID.x) % 16;
  for (uint k = gl_WorkGroupID.x; k < count; k += kLargeGroups) {
    uint point = large[2u * k];
    set_up(points[point], chunks[large[2u * k + 1u]]);
    int last = min(int(image.rows) - 1, p.last_row);
    for (int row = max(0, p.first_row) + lane_row; row <= last; row += 8) {
      fill_row(row, lane_column, 16, 2u * point);
    }
    if (gl_LocalInvocationID.x == 0u) fill_nearest(2u * point);
    done += 1u;
  }
  if (done > 0u) atomicAdd(through, done);
}

/// What a pixel holds, from the point that owns it.
void resolve() {
  uint at = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 128u + gl_LocalInvocationID.x;
  uint pixels = image.rows * image.columns;
  if (at >= pixels || owners[at] == kNowhere) return;
  uint point = owners[at] >> 1;
  uint low = 0u;
  uint high = call.chunks;
  while (high - low > 1u) {
    uint middle = (low + high) / 2u;
    if (chunks[middle].first <= point) {
      low = middle;
    } else {
      high = middle;
    }
  }
  PaperPoint given = points[point];
  set_up(given, chunks[low]);
  float depth;
  float cosine = 1.0f;
  if ((owners[at] & 1u) == 0u) hits_pixel(int(at / image.columns), int(at % image.columns), depth, cosine);
  planes[at] = uintBitsToFloat(depths[at]);
  planes[pixels + at] = cosine;
  planes[2u * pixels + at] = given.intensity;
}

void main() {
  if (call.task == kDrawDepths || call.task == kClaim) {
    draw_small();
  } else if (call.task == kResolve) {
    resolve();
  } else {
    draw_large();
  }
}
