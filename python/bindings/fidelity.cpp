// Exact scenes, and how well maps agree with them and with real scans.
#include <pybind11/stl.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pointflight/fidelity/scan_comparison.hpp"
#include "pointflight/fidelity/scene_beams.hpp"
#include "pointflight/scenes/scene_tree.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/map_object.hpp"
#include "python/bindings/run_objects.hpp"
#include "python/bindings/work.hpp"

namespace pointflight::python {
namespace {

constexpr double kNothing = std::numeric_limits<double>::infinity();

/// A scene as Python holds it, with what finds its shapes.
struct SceneObject {
  explicit SceneObject(const std::string& name) : scene(load_scene(name)), tree(scene) {}
  SceneObject(const SceneObject&) = delete;
  SceneObject& operator=(const SceneObject&) = delete;

  ExactScene scene;
  SceneTree tree;
};

py::dict dict_of(const ErrorStatistics& s) {
  py::dict dict;
  dict["rays"] = s.rays;
  dict["right"] = 1.0 - s.wrong_fraction - s.missing_fraction - s.false_fraction;
  dict["early"] = s.early_fraction;
  dict["late"] = s.late_fraction;
  dict["missing"] = s.missing_fraction;
  dict["false"] = s.false_fraction;
  dict["median_abs_error"] = s.median_abs_error;
  dict["p90_abs_error"] = s.p90_abs_error;
  dict["p95_abs_error"] = s.p95_abs_error;
  dict["bias"] = s.bias;
  return dict;
}

py::dict dict_of(const std::vector<FidelityRow>& rows) {
  py::dict dict;
  for (const FidelityRow& row : rows) dict[py::str(row.name)] = dict_of(row.statistics);
  return dict;
}

/// Ranges (n,) and numbers of tags (n,), -1 of what hits nothing.
py::tuple cast_into(const SceneObject& object,
                    const Array<double>& origins,
                    const Array<double>& directions,
                    double range_max) {
  const Array<double> from = rows_of_three(origins, "origins");
  const Array<double> along = rows_of_three(directions, "directions");
  const std::vector<Ray> rays = rays_from(from, along, range_limit(range_max));
  std::vector<double> ranges(rays.size(), kNothing);
  std::vector<std::int32_t> tags(rays.size(), -1);
  {
    const py::gil_scoped_release unlocked;
    executor()->parallel_for(rays.size(), 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Vector3d direction = rays[i].direction_world.cast<double>().normalized();
        const auto hit = object.tree.intersect(rays[i].origin_world, direction);
        if (!hit || hit->range > range_max) continue;
        ranges[i] = hit->range;
        tags[i] = object.scene.shape_tag[hit->shape];
      }
    });
  }
  const auto n = static_cast<py::ssize_t>(rays.size());
  return py::make_tuple(array_of(std::move(ranges), {n}), array_of(std::move(tags), {n}));
}

py::array_t<double> points_of(const SceneObject& object,
                              double resolution,
                              double noise,
                              std::uint64_t seed) {
  if (!(resolution >= 1e-3 && resolution <= 10.0 && noise >= 0.0 && noise <= 1.0)) {
    throw py::value_error(
        "points: a resolution of 0.001 to 10 m and a noise of 0 to 1 m are wanted");
  }
  std::vector<double> rows;
  {
    const py::gil_scoped_release unlocked;
    SceneSampling sampling;
    sampling.resolution = resolution;
    sampling.noise = noise;
    sampling.seed = seed;
    const auto cloud = sampled_cloud(object.scene, sampling);
    std::vector<CloudPoint> batch;
    while (cloud->read(batch)) {
      for (const CloudPoint& point : batch) {
        rows.insert(rows.end(), {point.position.x(), point.position.y(), point.position.z()});
      }
    }
  }
  const auto count = static_cast<py::ssize_t>(rows.size() / 3);
  return array_of(std::move(rows), {count, 3});
}

/// As `pointflight fidelity` of a map that is there.
py::dict fidelity_of(const SceneObject& object,
                     const MapObject& map,
                     std::size_t poses,
                     std::uint64_t seed) {
  if (poses < 1 || poses > 10'000) throw py::value_error("poses: 1 to 10000");
  FidelityReport report;
  {
    const py::gil_scoped_release unlocked;
    const auto threads = executor();
    BeamPlan plan;
    if (make_small_scene(object.scene.name)) {
      plan.name = "aimed";
      plan.range_max = 100.0f;
    } else {
      plan = *table_beams("avia_grid");
    }
    plan.poses = poses;
    plan.seed = seed;
    const SceneBeams beams = cast_exactly(object.scene, plan, *threads);
    report = measure_fidelity(object.scene, beams, *map.beams, *threads);
  }
  py::dict dict;
  dict["all"] = dict_of(report.all);
  dict["interior"] = dict_of(report.interior);
  dict["silhouette"] = dict_of(report.silhouette);
  dict["by_tag"] = dict_of(report.by_tag);
  dict["by_incidence"] = dict_of(report.by_incidence);
  dict["by_range"] = dict_of(report.by_range);
  return dict;
}

/// Measured and rendered ranges, whether the cloud supports the return (all without one) and
/// whether the map assumes what was hit, (n,) each; statistics of those that are supported.
py::tuple compare_with(const MapObject& map,
                       const Array<double>& points,
                       const Array<double>& origins,
                       const std::optional<Array<double>>& cloud) {
  const Array<double> to = rows_of_three(points, "points");
  const Array<double> from = rows_of_three(origins, "origins");
  const py::ssize_t count = to.shape(0);
  if (from.shape(0) != count && from.shape(0) != 1) {
    throw py::value_error("origins: one, or one for each point");
  }
  RealScan scan;
  for (py::ssize_t i = 0; i < count; ++i) {
    const py::ssize_t k = from.shape(0) == 1 ? 0 : i;
    const Vector3d origin(from.at(k, 0), from.at(k, 1), from.at(k, 2));
    const Vector3d way = Vector3d(to.at(i, 0), to.at(i, 1), to.at(i, 2)) - origin;
    const double range = way.norm();
    if (!(range > 1e-6 && range < 1e6)) {
      throw py::value_error("points: finite ones apart from their origins are wanted");
    }
    SurveyRay ray;
    ray.origin_world = origin;
    ray.direction_world = (way / range).cast<float>();
    ray.range = static_cast<float>(range);
    scan.rays.push_back(ray);
  }
  SupportedCells cells;
  if (cloud) {
    const Array<double> rows = rows_of_three(*cloud, "cloud");
    for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
      cells.add({rows.at(i, 0), rows.at(i, 1), rows.at(i, 2)});
    }
  }
  std::vector<ComparedRay> rays;
  {
    const py::gil_scoped_release unlocked;
    rays = compare_scan(scan, *map.beams, *map.map, cloud ? &cells : nullptr, *executor());
  }
  std::vector<double> measured;
  std::vector<double> rendered;
  std::vector<std::uint8_t> supported;
  std::vector<std::uint8_t> assumed;
  for (const ComparedRay& ray : rays) {
    measured.push_back(static_cast<double>(ray.range));
    rendered.push_back(ray.rendered < 0.0f ? kNothing : static_cast<double>(ray.rendered));
    supported.push_back(!cloud || ray.supported ? 1 : 0);
    assumed.push_back(ray.assumed ? 1 : 0);
  }
  const auto counts = [&](const ComparedRay& ray) { return !cloud || ray.supported; };
  return py::make_tuple(array_of(std::move(measured), {count}),
                        array_of(std::move(rendered), {count}),
                        array_of(std::move(supported), {count}),
                        array_of(std::move(assumed), {count}),
                        dict_of(collect(rays, counts).statistics()));
}

}  // namespace

void add_fidelity(py::module_& module) {
  using Object = SceneObject;
  py::class_<Object, std::shared_ptr<Object>>(module, "_Scene")
      .def(py::init<const std::string&>(), py::arg("name"))
      .def_property_readonly("name", [](const Object& o) { return o.scene.name; })
      .def_property_readonly("about", [](const Object& o) { return o.scene.about; })
      .def_property_readonly("tags", [](const Object& o) { return o.scene.tags; })
      .def("raycast", &cast_into, py::arg("origins"), py::arg("directions"), py::arg("range_max"))
      .def("points", &points_of, py::arg("resolution"), py::arg("noise"), py::arg("seed"))
      .def("fidelity", &fidelity_of, py::arg("map"), py::arg("poses"), py::arg("seed"));
  module.def("_scene_names", &scene_names);
  module.def("_compare",
             &compare_with,
             py::arg("map"),
             py::arg("points"),
             py::arg("origins"),
             py::arg("cloud"));
}

}  // namespace pointflight::python
