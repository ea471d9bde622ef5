#include "pointflight/survey/plane_holes.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "pointflight/core/math.hpp"
#include "pointflight/geometry/internal/grid_cells.hpp"

namespace pointflight {
namespace {

constexpr int kDirections = 16;
constexpr int kWindow = 2048;           // cells along a side of what is looked at at once
constexpr double kNeighbourhood = 1.2;  // m: patches so far away speak for a surfel

/// A surfel in a plane: u and v along it, h off it.
struct OnPlane {
  float u, v, h;                             // m from the plane's middle
  float radius;                              // m: farther from it it has no weight
  float inverse_uu, inverse_uv, inverse_vv;  // of its covariance as a ray across sees it, 1/m^2
  std::uint32_t word;
};

OnPlane on_plane(const SurfelMap& map, const Vector3d& d, const Matrix3d& axes, std::size_t word) {
  const Surfel surfel = decode(map.words()[word]);
  const Vector3d s = map.resolution() * surfel.s.cast<double>();
  const Matrix3d turned = axes.transpose() * surfel.axes.cast<double>();
  const Matrix3d covariance = turned * s.cwiseAbs2().asDiagonal() * turned.transpose();
  const double uu = covariance(0, 0);
  const double uv = covariance(0, 1);
  const double vv = covariance(1, 1);
  const double determinant = std::max(uu * vv - uv * uv, 1e-4 * (uu + vv) * (uu + vv));
  OnPlane on{};
  on.u = static_cast<float>(d.x());
  on.v = static_cast<float>(d.y());
  on.h = static_cast<float>(d.z());
  on.radius = static_cast<float>(static_cast<double>(map.model().support) * s[2]);
  on.inverse_uu = static_cast<float>(vv / determinant);
  on.inverse_uv = static_cast<float>(-uv / determinant);
  on.inverse_vv = static_cast<float>(uu / determinant);
  on.word = static_cast<std::uint32_t>(word);
  return on;
}

/// Axes of a plane, and what lies in it.
struct PlaneContent {
  Matrix3d axes = Matrix3d::Identity();  ///< Columns: u, v, normal.
  std::vector<OnPlane> surfels;
};

/// Which planes go through where.
class PatchIndex {
 public:
  PatchIndex(const std::vector<LargePlane>& planes, double near)
      : planes_(planes), near_(near), patches_(kNeighbourhood) {
    for (std::uint32_t plane = 0; plane < planes.size(); ++plane) {
      for (std::uint32_t i = 0; i < planes[plane].patches.size(); ++i) {
        patches_.add(planes[plane].patches[i].middle_world, {plane, i});
      }
    }
  }

  /// Calls `visit(plane)` once for each plane that a position lies in.
  template <class Visit>
  void for_each_plane(const Vector3d& position, const Visit& visit) const {
    std::vector<std::uint32_t> seen;
    patches_.for_each_around(position, [&](const Entry& entry) {
      if (std::ranges::find(seen, entry.plane) != seen.end()) return;
      const PlanePatch& patch = planes_[entry.plane].patches[entry.patch];
      const Vector3d d = position - patch.middle_world;
      if (std::abs(d.dot(patch.normal_world)) > near_) return;
      seen.push_back(entry.plane);
      visit(entry.plane);
    });
  }

 private:
  struct Entry {
    std::uint32_t plane, patch;
  };
  const std::vector<LargePlane>& planes_;
  double near_;
  GridIndex<Entry> patches_;
};

std::vector<PlaneContent> contents_of(const SurfelMap& map, const std::vector<LargePlane>& planes) {
  const double r = map.resolution();
  std::vector<PlaneContent> contents(planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const Vector3d& normal = planes[i].normal_world;
    contents[i].axes.col(0) = normal.unitOrthogonal();
    contents[i].axes.col(1) = normal.cross(contents[i].axes.col(0));
    contents[i].axes.col(2) = normal;
  }
  const PatchIndex index(planes, std::max(0.5 * r, 0.04));
  for_each_surfel(map.words(), [&](const LeafHeader& leaf, std::size_t word) {
    const Vector3d center = map.center_world(leaf, map.words()[word]);
    index.for_each_plane(center, [&](std::uint32_t plane) {
      const Vector3d d = contents[plane].axes.transpose() * (center - planes[plane].middle_world);
      contents[plane].surfels.push_back(on_plane(map, d, contents[plane].axes, word));
    });
  });
  return contents;
}

/// A rectangle of a plane in cells.
class PlaneRaster {
 public:
  PlaneRaster(int low_u, int low_v, int width, int height, float cell, const RenderModel& model)
      : low_u_(low_u),
        low_v_(low_v),
        width_(width),
        height_(height),
        cell_(cell),
        model_(model),
        cells_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

  /// Adds the weight that a surfel has in the middles of cells, by the hit rule.
  void add(const OnPlane& surfel) {
    const auto first = [&](float at) {
      return static_cast<int>(std::ceil((at - surfel.radius) / cell_ - 0.5f));
    };
    const auto last = [&](float at) {
      return static_cast<int>(std::floor((at + surfel.radius) / cell_ - 0.5f));
    };
    for (int v = std::max(first(surfel.v), low_v_); v <= std::min(last(surfel.v), top_v()); ++v) {
      for (int u = std::max(first(surfel.u), low_u_); u <= std::min(last(surfel.u), top_u()); ++u) {
        const float du = middle(u) - surfel.u;
        const float dv = middle(v) - surfel.v;
        const float squared = surfel.inverse_uu * du * du + 2.0f * surfel.inverse_uv * du * dv +
                              surfel.inverse_vv * dv * dv;
        const float inside = 1.0f - squared / (model_.support * model_.support);
        if (inside <= 0.0f) continue;
        const float weight = kFullWeight / (model_.support * model_.support) * inside * inside;
        Cell& cell = at(u, v);
        cell.coverage += weight;
        if (weight < cell.most) continue;
        cell.most = weight;
        cell.height = surfel.h;
        cell.word = surfel.word;
      }
    }
  }

  [[nodiscard]] bool is_inside(int u, int v) const {
    return u >= low_u_ && v >= low_v_ && u <= top_u() && v <= top_v();
  }
  [[nodiscard]] bool is_covered(int u, int v) const { return at(u, v).coverage >= model_.tau; }
  /// Of a covered cell, m.
  [[nodiscard]] float height(int u, int v) const { return at(u, v).height; }
  /// Of the surfel that covers a cell.
  [[nodiscard]] std::uint32_t word(int u, int v) const { return at(u, v).word; }
  [[nodiscard]] float middle(int i) const { return (static_cast<float>(i) + 0.5f) * cell_; }
  [[nodiscard]] int top_u() const { return low_u_ + width_ - 1; }
  [[nodiscard]] int top_v() const { return low_v_ + height_ - 1; }
  [[nodiscard]] int low_u() const { return low_u_; }
  [[nodiscard]] int low_v() const { return low_v_; }

 private:
  static constexpr float kFullWeight = 11.459f;  // 36 / pi, as in the hit rule
  struct Cell {
    float coverage = 0.0f;
    float most = 0.0f;  ///< Weight of one surfel.
    float height = 0.0f;
    std::uint32_t word = 0;
  };
  [[nodiscard]] std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v - low_v_) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(u - low_u_);
  }
  [[nodiscard]] const Cell& at(int u, int v) const { return cells_[index(u, v)]; }
  [[nodiscard]] Cell& at(int u, int v) { return cells_[index(u, v)]; }

  int low_u_, low_v_, width_, height_;
  float cell_;
  RenderModel model_;
  std::vector<Cell> cells_;
};

/// A plane as it goes through a cell of a hole.
struct PlaneAround {
  Vector3d plane;        ///< Its height in the middle of the cell, its slopes along u and v.
  std::uint32_t beside;  ///< The nearest surfel that was seen from there.
};

/// Looks around cells.
class HoleFinder {
 public:
  HoleFinder(const HoleOptions& options, double resolution)
      : steps_(static_cast<int>(options.reach / resolution)),
        gap_(static_cast<int>(options.gap / 360.0 * kDirections + 1e-6)),
        slope_(math::tan(options.tilt / 180.0 * std::numbers::pi)),
        rough_(options.roughness + 0.5 * resolution) {
    for (int k = 0; k < kDirections; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / kDirections;
      directions_[static_cast<std::size_t>(k)] = {math::cos(angle), math::sin(angle)};
    }
  }

  [[nodiscard]] int steps() const { return steps_; }

  /// Nothing if the cell does not lie in a hole.
  [[nodiscard]] std::optional<PlaneAround> around(const PlaneRaster& raster, int u, int v) const {
    std::array<bool, kDirections> is_seen{};
    std::array<Vector3d, kDirections> seen;
    std::size_t count = 0;
    int nearest = steps_ + 1;
    PlaneAround found{Vector3d::Zero(), 0};
    for (std::size_t k = 0; k < kDirections; ++k) {
      for (int step = 1; step <= steps_; ++step) {
        const int at_u = u + static_cast<int>(std::lround(step * directions_[k][0]));
        const int at_v = v + static_cast<int>(std::lround(step * directions_[k][1]));
        if (!raster.is_inside(at_u, at_v)) break;
        if (!raster.is_covered(at_u, at_v)) continue;
        is_seen[k] = true;
        seen[count++] = {static_cast<double>(raster.middle(at_u) - raster.middle(u)),
                         static_cast<double>(raster.middle(at_v) - raster.middle(v)),
                         static_cast<double>(raster.height(at_u, at_v))};
        if (step < nearest) {
          nearest = step;
          found.beside = raster.word(at_u, at_v);
        }
        break;
      }
    }
    if (widest_gap(is_seen) > gap_) return std::nullopt;
    const auto plane = fit(std::span(seen).first(count));
    if (!plane) return std::nullopt;
    found.plane = *plane;
    return found;
  }

 private:
  /// Directions from one that is seen to the next.
  static int widest_gap(const std::array<bool, kDirections>& is_seen) {
    int widest = 0;
    int run = 1;
    for (int k = 0; k < 2 * kDirections; ++k) {
      if (is_seen[static_cast<std::size_t>(k % kDirections)]) {
        run = 1;
      } else {
        widest = std::max(widest, ++run);
      }
    }
    return widest;
  }

  /// The plane of heights, if they lie in one.
  [[nodiscard]] std::optional<Vector3d> fit(std::span<const Vector3d> seen) const {
    Matrix3d left = Matrix3d::Zero();
    Vector3d right = Vector3d::Zero();
    for (const Vector3d& s : seen) {
      const Vector3d row(1.0, s.x(), s.y());
      left += row * row.transpose();
      right += s.z() * row;
    }
    const Vector3d plane = left.ldlt().solve(right);
    if (!plane.allFinite() || plane.tail<2>().norm() > slope_) return std::nullopt;
    for (const Vector3d& s : seen) {
      if (std::abs(plane.dot(Vector3d(1.0, s.x(), s.y())) - s.z()) > rough_) return std::nullopt;
    }
    return plane;
  }

  int steps_;
  int gap_;
  double slope_;
  double rough_;
  std::array<std::array<double, 2>, kDirections> directions_{};
};

/// Cells of a part of a plane.
struct CellWindow {
  int low_u, low_v, top_u, top_v;
};

/// The holes of a part of a plane.
void find_in_window(const LargePlane& plane,
                    const PlaneContent& content,
                    const CellWindow& window,
                    const HoleFinder& finder,
                    double resolution,
                    const RenderModel& model,
                    const Executor& executor,
                    std::vector<HoleCell>& holes) {
  const int halo = finder.steps() + 1;
  PlaneRaster raster(window.low_u - halo,
                     window.low_v - halo,
                     window.top_u - window.low_u + 1 + 2 * halo,
                     window.top_v - window.low_v + 1 + 2 * halo,
                     static_cast<float>(resolution),
                     model);
  for (const OnPlane& surfel : content.surfels) raster.add(surfel);
  const int height = window.top_v - window.low_v + 1;
  const auto rows = static_cast<std::size_t>(height);
  std::vector<std::vector<HoleCell>> found(rows);
  executor.parallel_for(rows, 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      const int v = window.low_v + static_cast<int>(row);
      for (int u = window.low_u; u <= window.top_u; ++u) {
        if (raster.is_covered(u, v)) continue;
        const auto around = finder.around(raster, u, v);
        if (!around) continue;
        const Vector3d& at = around->plane;
        const Vector3d local(
            static_cast<double>(raster.middle(u)), static_cast<double>(raster.middle(v)), at[0]);
        const Vector3d normal(-at[1], -at[2], 1.0);
        found[row].push_back({plane.middle_world + content.axes * local,
                              content.axes * normal.normalized(),
                              around->beside});
      }
    }
  });
  for (const auto& some : found) holes.insert(holes.end(), some.begin(), some.end());
}

}  // namespace

std::vector<HoleCell> find_hole_cells(const SurfelMap& map,
                                      const std::vector<LargePlane>& planes,
                                      const HoleOptions& options,
                                      const Executor& executor) {
  const double r = map.resolution();
  const std::vector<PlaneContent> contents = contents_of(map, planes);
  const HoleFinder finder(options, r);
  std::vector<HoleCell> holes;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (contents[i].surfels.empty()) continue;
    const auto along = [&](float OnPlane::*axis) {
      const auto [low, high] = std::ranges::minmax(contents[i].surfels, {}, axis);
      return std::pair(static_cast<int>(std::floor(static_cast<double>(low.*axis) / r)),
                       static_cast<int>(std::floor(static_cast<double>(high.*axis) / r)));
    };
    const auto [low_u, high_u] = along(&OnPlane::u);
    const auto [low_v, high_v] = along(&OnPlane::v);
    for (int v = low_v; v <= high_v; v += kWindow) {
      for (int u = low_u; u <= high_u; u += kWindow) {
        const CellWindow window = {
            u, v, std::min(u + kWindow - 1, high_u), std::min(v + kWindow - 1, high_v)};
        find_in_window(planes[i], contents[i], window, finder, r, map.model(), executor, holes);
      }
    }
  }
  return holes;
}

}  // namespace pointflight
