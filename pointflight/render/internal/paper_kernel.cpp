// The loops of the `paper` renderer, compiled once for each instruction set.
#include "pointflight/render/internal/paper_kernel.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/internal/simd_targets-inl.hpp"
// for foreach_target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pointflight/render/internal/paper_kernel.cpp"
#include <hwy/foreach_target.h>
// after foreach_target
#include "pointflight/core/internal/simd8-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

inline constexpr float kHalfTurn = 3.14159265f;
inline constexpr float kQuarterTurn = 1.57079633f;

/// atan2 to 3e-7 rad (Cephes' atanf: a polynomial up to tan(pi / 8), one reduction above).
POINTFLIGHT_INLINE F8 arc_tangent(const F8& y, const F8& x) {
  const F8 zero = splat(0.0f);
  const F8 ay = abs(y);
  const F8 ax = abs(x);
  const F8 small = min(ax, ay);
  const F8 large = max(max(ax, ay), splat(1e-30f));
  // tan of the angle to the nearer axis, in [0, 1]: above tan(pi / 8) from the diagonal
  const M8 steep = splat(0.41421356f) * large < small;
  const F8 a = select(steep, small - large, small) / select(steep, small + large, large);
  const F8 z = a * a;
  const F8 p =
      (((splat(8.05374449538e-2f) * z - splat(1.38776856032e-1f)) * z + splat(1.99777106478e-1f)) *
           z -
       splat(3.33329491539e-1f)) *
          z * a +
      a;
  const F8 to_axis = select(steep, p + splat(0.78539816f), p);
  const F8 from_x = select(ax < ay, splat(kQuarterTurn) - to_axis, to_axis);
  const F8 upper = select(x < zero, splat(kHalfTurn) - from_x, from_x);
  return select(y < zero, zero - upper, upper);
}

static void angles(const Ray* rays,
                   std::size_t count,
                   const float* m,
                   std::size_t begin,
                   std::size_t end,
                   float* azimuth,
                   float* elevation) {
  for (std::size_t i = begin; i < end; i += 8) {
    alignas(32) float d[3][8];
    for (std::size_t k = 0; k < 8; ++k) {
      const Ray& ray = rays[std::min(i + k, count - 1)];
      for (int axis = 0; axis < 3; ++axis) d[axis][k] = ray.direction_world[axis];
    }
    const F8 dx = load(d[0]);
    const F8 dy = load(d[1]);
    const F8 dz = load(d[2]);
    const F8 x = splat(m[0]) * dx + splat(m[1]) * dy + splat(m[2]) * dz;
    const F8 y = splat(m[3]) * dx + splat(m[4]) * dy + splat(m[5]) * dz;
    const F8 z = splat(m[6]) * dx + splat(m[7]) * dy + splat(m[8]) * dz;
    store_unaligned(arc_tangent(y, x), azimuth + i);
    store_unaligned(arc_tangent(z, sqrt(x * x + y * y)), elevation + i);
  }
}

/// Splats of eight points at a time, before those that matter are picked.
struct SplatLanes {
  alignas(32) float p[3][8], n[3][8], distance[8], cos_max[8], theta_max[8], row_at[8],
      column_at[8], reach_squared[8];
};

/// Point i + k of all, lane k of its eight.
POINTFLIGHT_INLINE PaperSplat splat_of(const PaperImage& image,
                                       const PaperPoints& points,
                                       const SplatLanes& s,
                                       std::size_t i,
                                       std::size_t k) {
  PaperSplat splat_k;  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  for (int axis = 0; axis < 3; ++axis) {
    splat_k.p[axis] = s.p[axis][k];
    splat_k.n[axis] = s.n[axis][k];
  }
  splat_k.distance = s.distance[k];
  splat_k.cos_max = s.cos_max[k];
  splat_k.theta_max = s.theta_max[k];
  splat_k.row_at = s.row_at[k];
  splat_k.column_at = s.column_at[k];
  splat_k.planar = points.planar[i + k];
  splat_k.intensity = points.intensity[i + k];
  splat_k.reach_squared = s.reach_squared[k];
  const float reach = s.theta_max[k] / image.step;
  // a point smaller than a pixel has at least the row that it is nearest to
  const float row = s.row_at[k];
  const float nearest = std::floor(row + 0.5f);
  splat_k.first_row = static_cast<int>(std::min(nearest, std::ceil(row - reach)));
  splat_k.last_row = static_cast<int>(std::max(nearest, std::floor(row + reach)));
  return splat_k;
}

static void project(const PaperImage& image,
                    const PaperPoints& points,
                    const float* corner,
                    const float* m,
                    std::vector<PaperSplat>& splats) {
  const F8 zero = splat(0.0f);
  const F8 one = splat(1.0f);
  for (std::size_t i = 0; i < points.count; i += 8) {
    const F8 radius = load_unaligned(points.radius.data() + i);
    // theta_max is below pi / 2 of its sine
    const F8 beside = splat(1.6f) * radius;
    const F8 qx = load_unaligned(points.x.data() + i);
    const F8 qy = load_unaligned(points.y.data() + i);
    const F8 qz = load_unaligned(points.z.data() + i);
    const F8 x = splat(corner[0]) + splat(m[0]) * qx + splat(m[1]) * qy + splat(m[2]) * qz;
    const F8 y = splat(corner[1]) + splat(m[3]) * qx + splat(m[4]) * qy + splat(m[5]) * qz;
    const F8 z = splat(corner[2]) + splat(m[6]) * qx + splat(m[7]) * qy + splat(m[8]) * qz;
    const F8 across = x * x + y * y;
    const F8 distance = sqrt(across + z * z);
    M8 seen = (distance <= splat(image.range_max) + radius) & (splat(1e-6f) <= distance) &
              (z <= distance * splat(image.sin_high) + beside) &
              (distance * splat(image.sin_low) - beside <= z);
    if (image.narrow) {
      seen = seen & (zero <= splat(image.left[0]) * x + splat(image.left[1]) * y + beside) &
             (zero <= splat(image.right[0]) * x + splat(image.right[1]) * y + beside);
    }
    const std::size_t there = std::min<std::size_t>(8, points.count - i);
    std::uint32_t left = bits(seen) & ((1u << there) - 1u);
    if (left == 0) continue;
    const F8 nx = load_unaligned(points.nx.data() + i);
    const F8 ny = load_unaligned(points.ny.data() + i);
    const F8 nz = load_unaligned(points.nz.data() + i);
    // eq. 1: theta_max = asin(radius / distance), bounded from above without trigonometry
    const F8 sine = min(one, radius / distance);
    const F8 sine2 = sine * sine;
    SplatLanes s;  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
    store(sine + splat(kQuarterTurn - 1.0f) * sine2 * sine, s.theta_max);
    store(sqrt(one - sine2), s.cos_max);
    store(splat(4.0f) * radius * radius, s.reach_squared);
    const F8 azimuth = arc_tangent(y, x);
    const F8 elevation = arc_tangent(z, sqrt(across));
    store((elevation - splat(image.elevation_min)) / splat(image.step), s.row_at);
    store((azimuth - splat(image.azimuth_min)) / splat(image.column_step), s.column_at);
    store(x, s.p[0]);
    store(y, s.p[1]);
    store(z, s.p[2]);
    store(splat(m[0]) * nx + splat(m[1]) * ny + splat(m[2]) * nz, s.n[0]);
    store(splat(m[3]) * nx + splat(m[4]) * ny + splat(m[5]) * nz, s.n[1]);
    store(splat(m[6]) * nx + splat(m[7]) * ny + splat(m[8]) * nz, s.n[2]);
    store(distance, s.distance);
    for (; left != 0; left &= left - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(left));
      const PaperSplat splat_k = splat_of(image, points, s, i, k);
      if (splat_k.last_row < 0 || splat_k.first_row >= image.rows) continue;
      splats.push_back(splat_k);
    }
  }
}

/// Fills those columns of [first, last] of a row that lie within theta_max of the point.
POINTFLIGHT_INLINE void fill_columns(
    PaperImage& image, const PaperSplat& s, int row, int first, int last) {
  const auto r = static_cast<std::size_t>(row);
  const F8 row_cos = splat(image.row_cos[r]);
  const F8 rz = splat(image.row_sin[r]);
  const F8 px = splat(s.p[0]);
  const F8 py = splat(s.p[1]);
  const F8 pz = splat(s.p[2]);
  const F8 nx = splat(s.n[0]);
  const F8 ny = splat(s.n[1]);
  const F8 nz = splat(s.n[2]);
  const F8 offset = splat(s.p[0] * s.n[0] + s.p[1] * s.n[1] + s.p[2] * s.n[2]);
  const F8 distance = splat(s.distance);
  const F8 limit = splat(s.cos_max * s.distance);
  const M8 planar = splat(0.5f) < splat(s.planar);
  const I8 end = splat_int(last + 1);
  for (int column = first; column <= last; column += 8) {
    const auto c = static_cast<std::size_t>(column);
    const F8 rx = row_cos * load_unaligned(image.column_cos.data() + c);
    const F8 ry = row_cos * load_unaligned(image.column_sin.data() + c);
    const M8 within = (limit <= rx * px + ry * py + rz * pz) & (count_from(column) < end);
    if (bits(within) == 0) continue;
    const F8 slope = nx * rx + ny * ry + nz * rz;
    const F8 steepness = abs(slope);
    // below, a plane's depth is ill-conditioned and its point is drawn as the paper draws others
    const M8 on_plane = planar & (splat(1e-3f) <= steepness);
    const F8 plane_depth = offset / slope;
    const F8 ex = plane_depth * rx - px;
    const F8 ey = plane_depth * ry - py;
    const F8 ez = plane_depth * rz - pz;
    // a point stands for a cube of substance: its plane ends near it (the paper leaves that open,
    // and grazing planes would reach to the sensor)
    const M8 near_point =
        (ex * ex + ey * ey + ez * ez < splat(s.reach_squared)) & (splat(0.0f) < plane_depth);
    const M8 drawn = without(within, without(on_plane, near_point));
    const F8 depth = select(on_plane, plane_depth, distance);
    const F8 cosine = select(planar, steepness, splat(1.0f));
    const std::size_t at = r * image.stride + c;
    const F8 old = load_unaligned(image.depth.data() + at);
    const M8 nearer = drawn & (depth < old);
    store_unaligned(select(nearer, depth, old), image.depth.data() + at);
    store_unaligned(select(nearer, cosine, load_unaligned(image.cosine.data() + at)),
                    image.cosine.data() + at);
    store_unaligned(select(nearer, splat(s.intensity), load_unaligned(image.intensity.data() + at)),
                    image.intensity.data() + at);
  }
}

POINTFLIGHT_INLINE void fill_row(PaperImage& image, const PaperSplat& s, int row) {
  const float row_cos = image.row_cos[static_cast<std::size_t>(row)];
  const float all = static_cast<float>(image.columns) + 1.0f;
  const float half =
      row_cos > 1e-3f ? s.theta_max / row_cos * 1.2f / image.column_step + 1.0f : all;
  const int columns = image.columns;
  if (half >= (image.full_turn ? 0.5f * all : all)) {
    fill_columns(image, s, row, 0, columns - 1);
    return;
  }
  const int first = static_cast<int>(std::ceil(s.column_at - half));
  const int last = static_cast<int>(std::floor(s.column_at + half));
  fill_columns(image, s, row, std::max(0, first), std::min(columns - 1, last));
  if (!image.full_turn) return;
  if (first < 0) fill_columns(image, s, row, first + columns, columns - 1);
  if (last >= columns) fill_columns(image, s, row, 0, last - columns);
}

static void fill(
    PaperImage& image, const PaperSplat* splats, std::size_t count, int row_begin, int row_end) {
  for (std::size_t i = 0; i < count; ++i) {
    const PaperSplat& s = splats[i];
    const int first = std::max(row_begin, s.first_row);
    const int last = std::min(row_end - 1, s.last_row);
    if (first > last) continue;
    for (int row = first; row <= last; ++row) fill_row(image, s, row);
    // smaller than a pixel: the pixel it projects to
    const int row = static_cast<int>(std::floor(s.row_at + 0.5f));
    int column = static_cast<int>(std::floor(s.column_at + 0.5f));
    if (image.full_turn) column = (column % image.columns + image.columns) % image.columns;
    if (row < first || row > last || column < 0 || column >= image.columns) continue;
    const auto r = static_cast<std::size_t>(row);
    const auto c = static_cast<std::size_t>(column);
    const float along =
        image.row_cos[r] * (image.column_cos[c] * s.p[0] + image.column_sin[c] * s.p[1]) +
        image.row_sin[r] * s.p[2];
    if (along >= s.cos_max * s.distance) continue;
    const std::size_t at = r * image.stride + c;
    if (!(s.distance < image.depth[at])) continue;
    image.depth[at] = s.distance;
    image.cosine[at] = 1.0f;
    image.intensity[at] = s.intensity;
  }
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pointflight {
namespace {

HWY_EXPORT(angles);
HWY_EXPORT(project);
HWY_EXPORT(fill);

using RowMajor = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;

}  // namespace

void PaperPoints::add(const Point& point) {
  x.push_back(point.place.x());
  y.push_back(point.place.y());
  z.push_back(point.place.z());
  nx.push_back(point.normal.x());
  ny.push_back(point.normal.y());
  nz.push_back(point.normal.z());
  planar.push_back(point.is_planar ? 1.0f : 0.0f);
  intensity.push_back(point.intensity);
  radius.push_back(point.radius);
  ++count;
}

void PaperPoints::finish() {
  const std::size_t room = (count + 7) / 8 * 8;
  for (std::vector<float>* values : {&x, &y, &z, &nx, &ny, &nz, &planar, &intensity, &radius}) {
    values->resize(room, 0.0f);
    values->shrink_to_fit();
  }
}

void paper_angles(std::span<const Ray> rays,
                  const Matrix3f& matrix,
                  std::size_t begin,
                  std::size_t end,
                  PaperAngles& angles) {
  const RowMajor rows = matrix;
  HWY_DYNAMIC_DISPATCH(angles)
  (rays.data(),
   rays.size(),
   rows.data(),
   begin,
   end,
   angles.azimuth.data(),
   angles.elevation.data());
}

void paper_project(const PaperImage& image,
                   const PaperPoints& points,
                   const Vector3f& corner,
                   const Matrix3f& turn,
                   std::vector<PaperSplat>& splats) {
  const RowMajor rows = turn;
  HWY_DYNAMIC_DISPATCH(project)(image, points, corner.data(), rows.data(), splats);
}

void paper_fill(PaperImage& image, std::span<const PaperSplat> splats, int row_begin, int row_end) {
  HWY_DYNAMIC_DISPATCH(fill)(image, splats.data(), splats.size(), row_begin, row_end);
}

}  // namespace pointflight
#endif  // HWY_ONCE
