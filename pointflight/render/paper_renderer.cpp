#include "pointflight/render/paper_renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"

namespace pointflight {
namespace {

constexpr float kEmpty = std::numeric_limits<float>::infinity();
// below, a plane's depth is ill-conditioned and its point is drawn as the paper draws the others
constexpr double kMinCosIncidence = 1e-3;

struct Angles {
  double azimuth;
  double elevation;
};

Angles angles_of(const Vector3d& v) {
  return {math::atan2(v.y(), v.x()), math::atan2(v.z(), std::hypot(v.x(), v.y()))};
}

}  // namespace

/// The depth image: rows of elevation, columns of azimuth, in the sensor's frame.
class PaperRenderer::Image {
 public:
  Image(const RayBatch& batch, const std::vector<Angles>& rays, double plane_reach)
      : step_(batch.image_resolution),
        range_max_(static_cast<double>(batch.range_max)),
        reach_squared_(plane_reach * plane_reach) {
    double low = kPi;
    double high = -kPi;
    elevation_min_ = kPi / 2;
    elevation_max_ = -kPi / 2;
    for (const Angles& a : rays) {
      low = std::min(low, a.azimuth);
      high = std::max(high, a.azimuth);
      elevation_min_ = std::min(elevation_min_, a.elevation);
      elevation_max_ = std::max(elevation_max_, a.elevation);
    }
    // rays on both sides of the rear: the whole turn
    full_turn_ = high - low > 2.0 * kPi - 10.0 * step_ || high - low > 1.9 * kPi;
    azimuth_min_ = full_turn_ ? -kPi : low;
    const double width = full_turn_ ? 2.0 * kPi : high - low;
    columns_ = static_cast<int>(std::ceil(width / step_ - 1e-9)) + (full_turn_ ? 0 : 1);
    rows_ = static_cast<int>(std::floor((elevation_max_ - elevation_min_) / step_ + 1e-9)) + 1;
    column_step_ = full_turn_ ? width / columns_ : step_;
    // half a pixel more, for points that round to the outermost
    sin_low_ = math::sin(std::max(-kPi / 2, elevation_min_ - step_));
    sin_high_ = math::sin(std::min(kPi / 2, elevation_max_ + step_));
    narrow_ = !full_turn_ && width < 0.9 * kPi;
    const auto from = math::sincos(azimuth_min_ - step_);
    const auto to = math::sincos(azimuth_min_ + width + step_);
    left_ = {-from.sin, from.cos};
    right_ = {to.sin, -to.cos};
    pixels_.assign(static_cast<std::size_t>(rows_) * static_cast<std::size_t>(columns_),
                   {kEmpty, 0.0f, 0.0f});
    for (int c = 0; c < columns_; ++c) {
      column_rays_.push_back(math::sincos(azimuth_min_ + c * column_step_));
    }
    for (int row = 0; row < rows_; ++row) {
      row_rays_.push_back(math::sincos(elevation_min_ + row * step_));
    }
  }

  struct Pixel {
    float depth;
    float intensity;
    float cos_incidence;
  };

  [[nodiscard]] int rows() const { return rows_; }

  /// False if a ball around `center` (sensor frame) lies wholly outside range and elevations.
  [[nodiscard]] bool may_see(const Vector3d& center, double radius) const {
    const double distance = center.norm();
    if (distance - radius > range_max_) return false;
    if (distance <= radius) return true;
    const double half = math::asin(radius / distance) + step_;
    const Angles a = angles_of(center);
    if (a.elevation + half < elevation_min_ || a.elevation - half > elevation_max_) return false;
    if (full_turn_) return true;
    const double cosine = math::cos(std::min(kPi / 2, std::abs(a.elevation) + half));
    if (cosine < 0.05) return true;  // near the poles every azimuth is close
    const double middle = azimuth_min_ + 0.5 * (columns_ - 1) * column_step_;
    double off = std::abs(a.azimuth - middle);
    off = std::min(off, 2.0 * kPi - off);
    return off <= 0.5 * columns_ * column_step_ + half / cosine;
  }

  /// A point on its way into the image.
  struct Splat {
    Vector3f p;  ///< Sensor frame, m.
    Vector3f normal;
    float intensity;
    bool planar;
    int first_row, last_row;  ///< Within theta_max, and the row that it projects to.
    double row_at;
    double azimuth;
    double distance;
    double theta_max;
  };

  /// False for a point that certainly fills no pixel, without trigonometry.
  [[nodiscard]] bool in_view(const Vector3d& p, double distance, double radius) const {
    const double beside = 1.6 * radius;  // theta_max is at most pi / 2 of the sine's angle
    if (distance > range_max_ + radius || distance < 1e-6) return false;
    if (p.z() > distance * sin_high_ + beside || p.z() < distance * sin_low_ - beside) return false;
    if (full_turn_ || !narrow_) return true;
    return left_.dot(p.head<2>()) >= -beside && right_.dot(p.head<2>()) >= -beside;
  }

  [[nodiscard]] std::optional<Splat> project(const Vector3d& p,
                                             const Vector3d& normal,
                                             bool planar,
                                             float intensity,
                                             double radius) const {
    const double distance = p.norm();
    if (!in_view(p, distance, radius)) return std::nullopt;
    Splat splat{p.cast<float>(), normal.cast<float>(), intensity, planar, 0, 0, 0, 0, distance, 0};
    splat.theta_max = distance > radius ? math::asin(radius / distance) : kPi / 2;
    const Angles a = angles_of(p);
    splat.azimuth = a.azimuth;
    splat.row_at = (a.elevation - elevation_min_) / step_;
    const double reach = splat.theta_max / step_;
    const int nearest = static_cast<int>(std::lround(splat.row_at));
    splat.first_row = std::min(nearest, static_cast<int>(std::ceil(splat.row_at - reach)));
    splat.last_row = std::max(nearest, static_cast<int>(std::floor(splat.row_at + reach)));
    if (splat.last_row < 0 || splat.first_row >= rows_) return std::nullopt;
    return splat;
  }

  /// Fills the pixels of rows [row_begin, row_end) within theta_max of the point.
  void fill(const Splat& splat, double radius, int row_begin, int row_end) {
    const Vector3d p = splat.p.cast<double>();
    const Vector3d normal = splat.normal.cast<double>();
    const double distance = splat.distance;
    const Angles a{splat.azimuth, 0.0};
    const int first = std::max(row_begin, splat.first_row);
    const int last = std::min(row_end - 1, splat.last_row);
    const Vector3d axis = p / distance;
    const double cos_max =
        std::sqrt(std::max(0.0, 1.0 - std::min(1.0, radius * radius / (distance * distance))));
    const double plane_offset = normal.dot(p);
    bool touched = false;
    for (int row = first; row <= last; ++row) {
      touched = fill_row(row,
                         a,
                         splat.theta_max,
                         axis,
                         cos_max,
                         normal,
                         plane_offset,
                         splat.planar,
                         distance,
                         splat.intensity) ||
                touched;
    }
    // smaller than a pixel: the pixel it projects to
    const int nearest_row = static_cast<int>(std::lround(splat.row_at));
    if (!touched && nearest_row >= row_begin && nearest_row < row_end) {
      const int column = column_of(a.azimuth);
      if (column >= 0) put(nearest_row, column, distance, 1.0, splat.intensity);
    }
  }

  [[nodiscard]] Hit look_up(const Angles& a) const {
    const int row = static_cast<int>(std::lround((a.elevation - elevation_min_) / step_));
    const int column = column_of(a.azimuth);
    if (row < 0 || row >= rows_ || column < 0) return {};
    const Pixel& pixel = pixels_[index(row, column)];
    if (pixel.depth == kEmpty || static_cast<double>(pixel.depth) > range_max_) return {};
    return {pixel.depth, pixel.cos_incidence, pixel.intensity};
  }

 private:
  [[nodiscard]] std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  /// Column of an azimuth, or -1 outside the image.
  [[nodiscard]] int column_of(double azimuth) const {
    const int column = static_cast<int>(std::lround((azimuth - azimuth_min_) / column_step_));
    if (full_turn_) return (column % columns_ + columns_) % columns_;
    return column >= 0 && column < columns_ ? column : -1;
  }

  bool fill_row(int row,
                const Angles& a,
                double theta_max,
                const Vector3d& axis,
                double cos_max,
                const Vector3d& normal,
                double plane_offset,
                bool planar,
                double distance,
                float intensity) {
    const math::SinCos elevation = row_rays_[static_cast<std::size_t>(row)];
    const double half = elevation.cos > 1e-3 ? theta_max / elevation.cos * 1.2 : 2.0 * kPi;
    const double at = (a.azimuth - azimuth_min_) / column_step_;
    const double reach = std::min(half / column_step_ + 1.0, 0.5 * columns_ + 1.0);
    const bool whole_row = full_turn_ && 2.0 * reach >= columns_;
    int first = whole_row ? 0 : static_cast<int>(std::ceil(at - reach));
    int last = whole_row ? columns_ - 1 : static_cast<int>(std::floor(at + reach));
    if (!full_turn_) {
      first = half >= kPi ? 0 : std::max(0, first);
      last = half >= kPi ? columns_ - 1 : std::min(columns_ - 1, last);
    }
    bool touched = false;
    for (int c = first; c <= last; ++c) {
      const int column = full_turn_ ? (c % columns_ + columns_) % columns_ : c;
      const math::SinCos azimuth = column_rays_[static_cast<std::size_t>(column)];
      const Vector3d ray(elevation.cos * azimuth.cos, elevation.cos * azimuth.sin, elevation.sin);
      if (ray.dot(axis) < cos_max) continue;
      touched = true;
      const double slope = normal.dot(ray);
      if (!planar || std::abs(slope) < kMinCosIncidence) {
        put(row, column, distance, planar ? std::abs(slope) : 1.0, intensity);
        continue;
      }
      // a point stands for a cube of substance: its plane ends near it (the paper leaves that open,
      // and grazing planes would reach to the sensor)
      const double depth = plane_offset / slope;
      const bool near_point = (depth * ray - distance * axis).squaredNorm() < reach_squared_;
      if (depth > 0.0 && near_point) put(row, column, depth, std::abs(slope), intensity);
    }
    return touched;
  }

  void put(int row, int column, double depth, double cos_incidence, float intensity) {
    Pixel& pixel = pixels_[index(row, column)];
    const auto d = static_cast<float>(depth);
    if (d < pixel.depth) pixel = {d, intensity, static_cast<float>(cos_incidence)};
  }

  double step_;
  double column_step_ = 0.0;
  double range_max_;
  double reach_squared_;
  double azimuth_min_ = 0.0;
  double elevation_min_ = 0.0;
  double elevation_max_ = 0.0;
  double sin_low_ = -1.0;  ///< Of the elevations.
  double sin_high_ = 1.0;
  Eigen::Vector2d left_ = Eigen::Vector2d::Zero();  ///< Inward normals of the azimuths' wedge.
  Eigen::Vector2d right_ = Eigen::Vector2d::Zero();
  bool narrow_ = false;  ///< The wedge is less than half a turn.
  bool full_turn_ = false;
  int rows_ = 0;
  int columns_ = 0;
  std::vector<Pixel> pixels_;
  std::vector<math::SinCos> column_rays_;
  std::vector<math::SinCos> row_rays_;
};

PaperRenderer::PaperRenderer(const Scene& scene, const PaperOptions& options)
    : map_(scene.map), options_(options) {
  const double l = options_.voxel_length;
  std::map<std::array<std::int64_t, 3>, std::size_t> index;
  const double gamma_max = options_.gamma_threshold * map_->resolution();
  map_->for_each_surfel(
      [&](const Vector3d& center, const Vector3d& normal, double thickness, std::uint32_t word) {
        const Vector3d cell = (center / l).array().floor();
        const std::array<std::int64_t, 3> key = {static_cast<std::int64_t>(cell.x()),
                                                 static_cast<std::int64_t>(cell.y()),
                                                 static_cast<std::int64_t>(cell.z())};
        const auto [at, is_new] = index.try_emplace(key, voxels_.size());
        if (is_new) voxels_.push_back({cell * l, {}});
        Voxel& voxel = voxels_[at->second];
        voxel.points.push_back({(center - voxel.corner_world).cast<float>(),
                                normal.cast<float>(),
                                map_->intensity(word),
                                thickness < gamma_max});
      });
}

void PaperRenderer::render(const RayBatch& batch,
                           std::span<Hit> hits,
                           const Executor& executor) const {
  if (batch.rays.empty()) return;
  const Pose T_sensor_world = batch.T_world_sensor.inverse();
  std::vector<Angles> angles(batch.rays.size());
  executor.parallel_for(angles.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      angles[i] = angles_of(T_sensor_world.rotation * batch.rays[i].direction_world.cast<double>());
    }
  });
  const double radius = std::sqrt(3.0) / 2.0 * map_->resolution();
  const double ball = std::sqrt(3.0) / 2.0 * options_.voxel_length + radius;
  Image image(batch, angles, 2.0 * radius);

  const Matrix3d turn = T_sensor_world.rotation.toRotationMatrix();
  std::vector<std::size_t> seen;
  const Vector3d half = Vector3d::Constant(0.5 * options_.voxel_length);
  for (std::size_t v = 0; v < voxels_.size(); ++v) {
    if (image.may_see(T_sensor_world * (voxels_[v].corner_world + half), ball)) seen.push_back(v);
  }
  // first every point once, then bands of rows: each pixel belongs to one band, each band takes the
  // points in the same order, so the result does not depend on threads
  constexpr std::size_t kVoxels = 16;
  std::vector<std::vector<Image::Splat>> splats((seen.size() + kVoxels - 1) / kVoxels);
  executor.parallel_for(seen.size(), kVoxels, [&](std::size_t begin, std::size_t end) {
    auto& own = splats[begin / kVoxels];
    for (std::size_t v = begin; v < end; ++v) {
      const Voxel& voxel = voxels_[seen[v]];
      const Vector3d corner = T_sensor_world * voxel.corner_world;
      for (const Point& point : voxel.points) {
        const Vector3d p = corner + turn * point.position.cast<double>();
        const Vector3d n = turn * point.normal.cast<double>();
        if (const auto splat = image.project(p, n, point.planar, point.intensity, radius)) {
          own.push_back(*splat);
        }
      }
    }
  });
  constexpr std::size_t kBand = 32;
  executor.parallel_for(
      static_cast<std::size_t>(image.rows()), kBand, [&](std::size_t begin, std::size_t end) {
        const int first = static_cast<int>(begin);
        const int last = static_cast<int>(end) - 1;
        for (const auto& chunk : splats) {
          for (const Image::Splat& splat : chunk) {
            if (splat.last_row < first || splat.first_row > last) continue;
            image.fill(splat, radius, first, last + 1);
          }
        }
      });
  for (std::size_t i = 0; i < hits.size(); ++i) {
    hits[i] = image.look_up(angles[i]);
    if (hits[i].range > batch.rays[i].range_max) hits[i] = {};
  }
}

}  // namespace pointflight
