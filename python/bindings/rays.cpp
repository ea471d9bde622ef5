// Single rays: from anywhere, and of range images.
#include "python/bindings/rays.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "pointflight/core/math.hpp"
#include "pointflight/map/surfel.hpp"
#include "pointflight/render/ray_casting.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/map_object.hpp"
#include "python/bindings/work.hpp"

namespace pointflight::python {
namespace {

constexpr double kNoHit = std::numeric_limits<double>::infinity();

constexpr std::uint16_t kNothing = 65535;  // label of a ray that hits nothing

/// Normals towards the rays' origins, world frame.
void write_normals(const SurfelMap& map,
                   std::span<const Ray> rays,
                   std::span<const Hit> hits,
                   std::span<float> normals) {
  for (std::size_t i = 0; i < hits.size(); ++i) {
    Vector3f normal = Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
    if (hits[i].is_return() && hits[i].surfel < map.words().size()) {
      normal = decode(map.words()[hits[i].surfel]).axes.col(0);
      if (normal.dot(rays[i].direction_world) > 0.0f) normal = -normal;
    }
    for (int k = 0; k < 3; ++k) normals[3 * i + static_cast<std::size_t>(k)] = normal[k];
  }
}

py::tuple cast_in(const MapObject& object,
                  const Array<double>& origins,
                  const Array<double>& directions,
                  double range_max) {
  return hits_in(*object.map, *object.beams, origins, directions, range_max, {}, {});
}

py::array_t<float> ranges_in(const MapObject& object,
                             const Array<double>& poses,
                             const Array<double>& directions,
                             double range_max) {
  require_shape(directions, "directions", {-1, -1, 3});
  const float limit = range_limit(range_max);
  const std::vector<Pose> from = poses_from(poses, "poses");
  const auto beams = static_cast<std::size_t>(directions.shape(0) * directions.shape(1));
  std::vector<Vector3f> of_sensor(beams);
  for (std::size_t i = 0; i < beams; ++i) {
    of_sensor[i] = direction_from(directions.data() + 3 * i, "directions");
  }
  std::vector<float> ranges(from.size() * beams);
  {
    const py::gil_scoped_release unlocked;
    std::vector<Ray> rays(ranges.size());
    for (std::size_t p = 0; p < from.size(); ++p) {
      const Matrix3f turn = from[p].rotation.toRotationMatrix().cast<float>();
      for (std::size_t i = 0; i < beams; ++i) {
        rays[p * beams + i] = {from[p].translation, (turn * of_sensor[i]).normalized(), limit};
      }
    }
    std::vector<Hit> hits(rays.size());
    cast_rays(*object.beams, rays, hits, *executor());
    for (std::size_t i = 0; i < hits.size(); ++i) {
      ranges[i] = hits[i].is_return() ? hits[i].range : limit;
    }
  }
  return array_of(
      std::move(ranges),
      {static_cast<py::ssize_t>(from.size()), directions.shape(0), directions.shape(1)});
}

/// Directions (rows, columns, 3) of the centres of an image's cells: unit vectors, the same on
/// every processor.
py::array_t<double> grid_of(
    std::size_t rows, std::size_t columns, double low, double high, double right, double left) {
  std::vector<double> all;
  all.reserve(3 * rows * columns);
  for (std::size_t i = 0; i < rows; ++i) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(rows);
    const auto up = math::sincos(high - (high - low) * share);
    for (std::size_t k = 0; k < columns; ++k) {
      const double across = (static_cast<double>(k) + 0.5) / static_cast<double>(columns);
      const auto around = math::sincos(left - (left - right) * across);
      all.insert(all.end(), {up.cos * around.cos, up.cos * around.sin, up.sin});
    }
  }
  return array_of(std::move(all),
                  {static_cast<py::ssize_t>(rows), static_cast<py::ssize_t>(columns), 3});
}

}  // namespace

py::tuple hits_in(const SurfelMap& map,
                  const Renderer& beams,
                  const Array<double>& origins,
                  const Array<double>& directions,
                  double range_max,
                  std::span<const Body> bodies,
                  SimTime time) {
  const std::vector<Ray> rays = rays_from(rows_of_three(origins, "origins"),
                                          rows_of_three(directions, "directions"),
                                          range_limit(range_max));
  const std::size_t count = rays.size();
  std::vector<double> ranges(count, kNoHit);
  std::vector<double> points(3 * count, std::numeric_limits<double>::quiet_NaN());
  std::vector<float> normals(3 * count);
  std::vector<float> incidences(count, std::numeric_limits<float>::quiet_NaN());
  std::vector<float> intensities(count, 0.0f);
  std::vector<std::uint32_t> surfels(count, kNoSurfel);
  std::vector<std::uint16_t> labels(count, kNothing);
  {
    const py::gil_scoped_release unlocked;
    std::vector<Hit> hits(count);
    cast_rays(beams, rays, hits, *executor(), bodies, time);
    write_normals(map, rays, hits, normals);
    for (std::size_t i = 0; i < count; ++i) {
      if (!hits[i].is_return()) continue;
      ranges[i] = static_cast<double>(hits[i].range);
      const Vector3d point =
          rays[i].origin_world + ranges[i] * rays[i].direction_world.cast<double>();
      for (int k = 0; k < 3; ++k) points[3 * i + static_cast<std::size_t>(k)] = point[k];
      const double cosine = std::clamp(static_cast<double>(hits[i].cos_incidence), 0.0, 1.0);
      incidences[i] = static_cast<float>(math::acos(cosine));
      intensities[i] = hits[i].intensity;
      surfels[i] = hits[i].surfel;
      labels[i] = static_cast<std::uint16_t>(hits[i].label);
    }
  }
  const auto n = static_cast<py::ssize_t>(count);
  return py::make_tuple(array_of(std::move(ranges), {n}),
                        array_of(std::move(points), {n, 3}),
                        array_of(std::move(normals), {n, 3}),
                        array_of(std::move(incidences), {n}),
                        array_of(std::move(intensities), {n}),
                        array_of(std::move(surfels), {n}),
                        array_of(std::move(labels), {n}));
}

void add_rays(py::module_& module) {
  module.def("_raycast",
             &cast_in,
             py::arg("map"),
             py::arg("origins"),
             py::arg("directions"),
             py::arg("range_max"));
  module.def("_ranges",
             &ranges_in,
             py::arg("map"),
             py::arg("poses"),
             py::arg("directions"),
             py::arg("range_max"));
  module.def("_grid",
             &grid_of,
             py::arg("rows"),
             py::arg("columns"),
             py::arg("low"),
             py::arg("high"),
             py::arg("right"),
             py::arg("left"));
}

}  // namespace pointflight::python
