#include "pointflight/render/internal/paper_renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/constants.hpp"
#include "pointflight/core/floor.hpp"
#include "pointflight/core/math.hpp"

namespace pointflight {
namespace {

constexpr float kEmpty = std::numeric_limits<float>::infinity();

/// Least and greatest angles of the rays.
struct Extent {
  float azimuth_min = kEmpty, azimuth_max = -kEmpty;
  float elevation_min = kEmpty, elevation_max = -kEmpty;
};

Extent extent_of(const PaperAngles& angles, std::size_t count) {
  Extent extent;
  for (std::size_t i = 0; i < count; ++i) {
    extent.azimuth_min = std::min(extent.azimuth_min, angles.azimuth[i]);
    extent.azimuth_max = std::max(extent.azimuth_max, angles.azimuth[i]);
    extent.elevation_min = std::min(extent.elevation_min, angles.elevation[i]);
    extent.elevation_max = std::max(extent.elevation_max, angles.elevation[i]);
  }
  return extent;
}

/// An empty image laid over the rays.
PaperImage image_over(const Extent& rays, const RayBatch& batch) {
  const double step = batch.image_resolution;
  const auto low = static_cast<double>(rays.azimuth_min);
  const double spread = static_cast<double>(rays.azimuth_max) - low;
  const auto bottom = static_cast<double>(rays.elevation_min);
  const auto top = static_cast<double>(rays.elevation_max);
  PaperImage image;
  // rays on both sides of the rear: the whole turn
  image.full_turn = spread > 2.0 * kPi - 10.0 * step || spread > 1.9 * kPi;
  const double azimuth_min = image.full_turn ? -kPi : low;
  const double width = image.full_turn ? 2.0 * kPi : spread;
  image.columns = static_cast<int>(std::ceil(width / step - 1e-4)) + (image.full_turn ? 0 : 1);
  image.rows = static_cast<int>(std::floor((top - bottom) / step + 1e-4)) + 1;
  const double column_step = image.full_turn ? width / image.columns : step;
  image.step = static_cast<float>(step);
  image.column_step = static_cast<float>(column_step);
  image.azimuth_min = static_cast<float>(azimuth_min);
  image.elevation_min = static_cast<float>(bottom);
  image.range_max = batch.range_max;
  // half a pixel more, for points that round to the outermost
  image.sin_low = static_cast<float>(math::sin(std::max(-kPi / 2, bottom - step)));
  image.sin_high = static_cast<float>(math::sin(std::min(kPi / 2, top + step)));
  image.narrow = !image.full_turn && width < 0.9 * kPi;
  const auto from = math::sincos(azimuth_min - step);
  const auto to = math::sincos(azimuth_min + width + step);
  image.left[0] = static_cast<float>(-from.sin);
  image.left[1] = static_cast<float>(from.cos);
  image.right[0] = static_cast<float>(to.sin);
  image.right[1] = static_cast<float>(-to.cos);
  image.stride = static_cast<std::size_t>(image.columns) + 8;
  const auto rows = static_cast<std::size_t>(image.rows);
  image.depth.assign(rows * image.stride, kEmpty);
  image.cosine.resize(image.depth.size());
  image.intensity.resize(image.depth.size());
  for (std::size_t c = 0; c < image.stride; ++c) {
    const auto angle = math::sincos(azimuth_min + static_cast<double>(c) * column_step);
    image.column_cos.push_back(static_cast<float>(angle.cos));
    image.column_sin.push_back(static_cast<float>(angle.sin));
  }
  for (std::size_t row = 0; row < rows; ++row) {
    const auto angle = math::sincos(bottom + static_cast<double>(row) * step);
    image.row_cos.push_back(static_cast<float>(angle.cos));
    image.row_sin.push_back(static_cast<float>(angle.sin));
  }
  return image;
}

/// False if a ball around `center` (sensor frame) lies wholly outside the image.
bool may_see(const PaperImage& image, const Vector3d& center, double radius) {
  const double distance = center.norm();
  if (distance - radius > static_cast<double>(image.range_max)) return false;
  if (distance <= radius) return true;
  const double high = static_cast<double>(image.sin_high) * distance;
  const double low = static_cast<double>(image.sin_low) * distance;
  const double beside = kPi / 2 * radius;  // along the sphere through the centre
  if (center.z() > high + beside || center.z() < low - beside) return false;
  if (!image.narrow) return true;
  const auto inside = [&](const float* normal) {
    return static_cast<double>(normal[0]) * center.x() +
               static_cast<double>(normal[1]) * center.y() >=
           -radius;
  };
  return inside(image.left) && inside(image.right);
}

/// Depth, cosine and intensity of the pixel that a ray falls in.
Hit look_up(const PaperImage& image, float azimuth, float elevation) {
  const auto row = static_cast<int>(
      floor_to_integer(static_cast<double>((elevation - image.elevation_min) / image.step) + 0.5));
  auto column = static_cast<int>(floor_to_integer(
      static_cast<double>((azimuth - image.azimuth_min) / image.column_step) + 0.5));
  if (image.full_turn) column = (column % image.columns + image.columns) % image.columns;
  if (row < 0 || row >= image.rows || column < 0 || column >= image.columns) return {};
  const std::size_t at =
      static_cast<std::size_t>(row) * image.stride + static_cast<std::size_t>(column);
  if (!(image.depth[at] <= image.range_max)) return {};
  return {image.depth[at], image.cosine[at], image.intensity[at], kMapLabel, kNoSurfel};
}

/// The paper's point of a cell: half the diagonal of its cube, m.
double radius_of(double cell_width) {
  return std::sqrt(3.0) / 2.0 * cell_width;
}

/// Points of a surface, `spacing` apart (the body's frame). Their normals are not used.
PaperPoints surface_as_points(const std::vector<Vector3d>& surface, double spacing) {
  PaperPoints points;
  const auto radius = static_cast<float>(radius_of(spacing));
  for (const Vector3d& p : surface) {
    points.add({p.cast<float>(), Vector3f::UnitZ(), false, 0.0f, radius});
  }
  return points;
}

/// How wide the cells are that surfels stand for. The paper knows one width; maps have several, and
/// what they store is only the spread: small cells share a voxel of the map, and the spread of a
/// filled cell is its width / sqrt(12). A wide cell, which is flat, becomes the points on it that
/// the paper's one width would have given.
class CellWidths {
  static constexpr double kWide = 1.8;

 public:
  explicit CellWidths(const SurfelMap& map) : map_(map) {
    voxels_.reserve(map.surfel_count());
    for_each_surfel(map.words(), [&](const LeafHeader& leaf, std::size_t word) {
      voxels_.push_back(voxel_of(leaf, decode(map.words()[word])));
    });
    std::sort(voxels_.begin(), voxels_.end());
  }

  /// `visit(point in the world, its PaperPoints::Point without the position)`
  template <class Visit>
  void for_each_point(double gamma_threshold, const Visit& visit) const {
    const double r = map_.resolution();
    for_each_surfel(map_.words(), [&](const LeafHeader& leaf, std::size_t word) {
      const Surfel surfel = decode(map_.words()[word]);
      const double whole = r * cells_wide(leaf, surfel);
      const int side = std::max(1, static_cast<int>(std::lround(whole / r)));  // points
      const double width = whole / side;
      const Vector3d center = map_.origin_world() + r * (Vector3d(leaf.x, leaf.y, leaf.z) +
                                                         surfel.center_voxels.cast<double>());
      const PaperPoints::Point point{Vector3f::Zero(),
                                     surfel.axes.col(0),
                                     static_cast<double>(surfel.s[0]) * r < gamma_threshold * width,
                                     map_.intensity(static_cast<std::uint32_t>(word)),
                                     static_cast<float>(radius_of(width))};
      for (int i = 0; i < side * side; ++i) {
        const double u = width * (i % side - 0.5 * (side - 1));
        const double v =
            width * (i / side - 0.5 * (side - 1));  // NOLINT(bugprone-integer-division)
        visit(
            center + u * surfel.axes.col(1).cast<double>() + v * surfel.axes.col(2).cast<double>(),
            point);
      }
    });
  }

 private:
  static std::uint64_t voxel_of(const LeafHeader& leaf, const Surfel& surfel) {
    const auto place = [&](std::uint32_t low, int axis) {
      return low + static_cast<std::uint64_t>(surfel.center_voxels[axis]);
    };
    return place(leaf.x, 0) | place(leaf.y, 1) << 21 | place(leaf.z, 2) << 42;
  }
  [[nodiscard]] double cells_wide(const LeafHeader& leaf, const Surfel& surfel) const {
    const auto [from, to] =
        std::equal_range(voxels_.begin(), voxels_.end(), voxel_of(leaf, surfel));
    if (to - from > 1) return 0.5;
    const double wide = std::sqrt(12.0) * static_cast<double>(surfel.s[1]);
    return wide < kWide ? 1.0 : wide;
  }

  const SurfelMap& map_;
  std::vector<std::uint64_t> voxels_;  // of the surfels, sorted
};

PaperPoints map_as_points(const SurfelMap& map, double gamma_threshold) {
  PaperPoints points;
  CellWidths(map).for_each_point(gamma_threshold,
                                 [&](const Vector3d& center, PaperPoints::Point point) {
                                   point.place = center.cast<float>();
                                   points.add(point);
                                 });
  return points;
}

}  // namespace

PaperRenderer::PaperRenderer(const Scene& scene,
                             const PaperOptions& options,
                             const MakePainter& make_painter)
    : map_(scene.map), options_(options) {
  require_argument(map_ != nullptr, "PaperRenderer: the scene has no map");
  require_argument(options_.voxel_length > 0.0, "PaperRenderer: a voxel length above 0 is wanted");
  const double l = options_.voxel_length;
  std::map<std::array<std::int64_t, 3>, std::size_t> index;
  CellWidths(*map_).for_each_point(
      options_.gamma_threshold, [&](const Vector3d& center, PaperPoints::Point point) {
        const Vector3d cell = (center / l).array().floor();
        const std::array<std::int64_t, 3> key = {static_cast<std::int64_t>(cell.x()),
                                                 static_cast<std::int64_t>(cell.y()),
                                                 static_cast<std::int64_t>(cell.z())};
        const auto [at, is_new] = index.try_emplace(key, voxels_.size());
        if (is_new) voxels_.push_back({cell * l, {}});
        PaperVoxel& voxel = voxels_[at->second];
        point.place = (center - voxel.corner_world).cast<float>();
        largest_radius_ = std::max(largest_radius_, static_cast<double>(point.radius));
        voxel.points.add(point);
      });
  for (PaperVoxel& voxel : voxels_) voxel.points.finish();
  painter_ = make_painter ? make_painter(voxels_) : make_processor_painter(voxels_);
}

PaperPoints PaperRenderer::points_of(const Body& body, SimTime time) const {
  const double spacing = map_->resolution();
  if (body.look) return surface_as_points(surface_points(*body.look, spacing, time), spacing);
  if (const auto* solid = std::get_if<Solid>(&body.shape)) {
    return surface_as_points(surface_points(*solid, spacing), spacing);
  }
  return map_as_points(*std::get<std::shared_ptr<const SurfelMap>>(body.shape),
                       options_.gamma_threshold);
}

void PaperRenderer::draw_bodies(const RayBatch& batch,
                                const Pose& T_sensor_world,
                                PaperImage& image) const {
  std::fill(image.depth.begin(), image.depth.end(), kEmpty);
  for (std::size_t number = 0; number < batch.bodies.size(); ++number) {
    const Body& body = batch.bodies[number];
    if (batch.snapshot_time < body.from || batch.snapshot_time >= body.until) continue;
    const Pose T_sensor_body = T_sensor_world * body.T_world_body(batch.snapshot_time);
    if (!may_see(image, T_sensor_body.translation, visible_radius(body))) continue;
    PaperPoints points = points_of(body, batch.snapshot_time);
    std::fill(points.intensity.begin(), points.intensity.end(), static_cast<float>(number));
    points.finish();
    std::vector<PaperSplat> splats;
    paper_project(image,
                  points,
                  T_sensor_body.translation.cast<float>(),
                  T_sensor_body.rotation.toRotationMatrix().cast<float>(),
                  splats);
    paper_fill(image, splats, 0, image.rows);
  }
}

void PaperRenderer::render_one(const RenderJob& job, const Executor& executor) const {
  const RayBatch& batch = job.batch;
  const std::span<Hit> hits = job.hits;
  if (batch.rays.empty()) return;
  const Pose T_sensor_world = batch.T_world_sensor.inverse();
  const Matrix3f turn = T_sensor_world.rotation.toRotationMatrix().cast<float>();
  PaperAngles angles(batch.rays.size());
  executor.parallel_for(batch.rays.size(), 4096, [&](std::size_t begin, std::size_t end) {
    paper_angles(batch.rays, turn, begin, end, angles);
  });
  PaperImage image = image_over(extent_of(angles, batch.rays.size()), batch);

  const double ball = radius_of(options_.voxel_length) + largest_radius_;
  const Vector3d half = Vector3d::Constant(0.5 * options_.voxel_length);
  std::vector<std::size_t> seen;
  for (std::size_t v = 0; v < voxels_.size(); ++v) {
    if (may_see(image, T_sensor_world * (voxels_[v].corner_world + half), ball)) seen.push_back(v);
  }
  painter_->draw(seen, T_sensor_world, image, executor);
  executor.parallel_for(hits.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      hits[i] = look_up(image, angles.azimuth[i], angles.elevation[i]);
      if (hits[i].range > batch.rays[i].range_max) hits[i] = {};
    }
  });
  if (batch.bodies.empty()) return;
  draw_bodies(batch, T_sensor_world, image);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Hit met = look_up(image, angles.azimuth[i], angles.elevation[i]);
    if (!met.is_return() || met.range > batch.rays[i].range_max) continue;
    if (hits[i].is_return() && hits[i].range <= met.range) continue;
    const Body& body = batch.bodies[static_cast<std::size_t>(met.intensity)];
    hits[i] = {met.range, met.cos_incidence, body.intensity, body.label, kNoSurfel};
  }
}

}  // namespace pointflight
