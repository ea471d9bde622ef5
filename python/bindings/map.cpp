// Maps: opened, made of clouds, asked for distances and surfels.
#include <pybind11/stl.h>

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pointflight/core/output_file.hpp"
#include "pointflight/map/surfel.hpp"
#include "pointflight/survey/cloud_map.hpp"
#include "pointflight/world/free_space.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/map_object.hpp"
#include "python/bindings/work.hpp"

namespace pointflight::python {
namespace {

/// A surfel as `Map.surfels` gives it.
struct SurfelRow {
  double center[3];
  float normal[3];
  float axis[3];
  float sigmas[3];
  float intensity;
  std::uint32_t word;
  std::uint8_t assumed;
  std::uint8_t kind;
  std::uint8_t opacity;
  std::uint32_t thing;
};

std::shared_ptr<MapObject> open_map(const std::string& path) {
  const py::gil_scoped_release unlocked;
  return std::make_shared<MapObject>(SurfelMap::open(path));
}

std::shared_ptr<MapObject> import_clouds_as_map(const std::vector<std::string>& clouds,
                                                const std::optional<std::string>& output,
                                                const std::optional<double>& resolution,
                                                const std::string& name,
                                                const py::object& progress) {
  if (clouds.empty()) throw py::value_error("clouds: at least one is wanted");
  ImportOptions options;
  options.resolution = resolution;
  const Progress report = interruptible(progress);
  const py::gil_scoped_release unlocked;
  std::optional<OutputFile> file;
  if (output) file.emplace(*output);
  const std::vector<CloudSource> sources(clouds.begin(), clouds.end());
  CloudMap made = map_clouds(sources, options, *executor(), report);
  if (!file) {
    return std::make_shared<MapObject>(
        SurfelMap::from_bytes(map_bytes(made.map.tree, made.map.description), name));
  }
  write_map(std::move(*file), made.map.tree, made.map.description);
  return std::make_shared<MapObject>(SurfelMap::open(*output));
}

py::array_t<double> bounds_of(const MapObject& map) {
  const Aabb& box = map.map->bounds_world();
  py::array_t<double> bounds({2, 3});
  for (int i = 0; i < 3; ++i) {
    bounds.mutable_at(0, i) = box.min[i];
    bounds.mutable_at(1, i) = box.max[i];
  }
  return bounds;
}

/// Distances to the nearest surfel, infinite beyond the reach or at NaN, and that surfel's centre.
py::tuple nearest_to(const MapObject& map, const Array<double>& points, double reach) {
  if (!(reach > 0.0)) throw py::value_error("reach: above 0 m is wanted");
  const Array<double> rows = rows_of_three(points, "points");
  const auto count = static_cast<std::size_t>(rows.shape(0));
  std::vector<double> distances(count, std::numeric_limits<double>::infinity());
  std::vector<double> centers(3 * count, std::numeric_limits<double>::quiet_NaN());
  const double* at = rows.data();
  {
    const py::gil_scoped_release unlocked;
    executor()->parallel_for(count, 512, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Vector3d point(at[3 * i], at[3 * i + 1], at[3 * i + 2]);
        const auto found = map.map->nearest(point, reach);
        if (!found) continue;
        distances[i] = found->distance;
        for (int k = 0; k < 3; ++k) {
          centers[3 * i + static_cast<std::size_t>(k)] = found->center_world[k];
        }
      }
    });
  }
  const auto rows_count = static_cast<py::ssize_t>(count);
  return py::make_tuple(array_of(std::move(distances), {rows_count}),
                        array_of(std::move(centers), {rows_count, 3}));
}

py::array_t<SurfelRow> surfels_of(const MapObject& object) {
  const SurfelMap& map = *object.map;
  std::vector<SurfelRow> rows;
  {
    const py::gil_scoped_release unlocked;
    rows.reserve(map.surfel_count());
    for_each_surfel(map.words(), [&](const LeafHeader& leaf, std::size_t word) {
      const Surfel surfel = decode(map.words()[word]);
      const Vector3d center = map.center_world(leaf, map.words()[word]);
      SurfelRow& row = rows.emplace_back();
      for (int k = 0; k < 3; ++k) {
        row.center[k] = center[k];
        row.normal[k] = surfel.axes(k, 0);
        row.axis[k] = surfel.axes(k, 2);
        row.sigmas[k] = surfel.s[k] * static_cast<float>(map.resolution());
      }
      row.word = static_cast<std::uint32_t>(word);
      row.intensity = map.intensity(row.word);
      const SurfelNote note = map.notes().of(row.word);
      row.assumed = note.is_assumed ? 1 : 0;
      row.kind = note.label.kind;
      row.thing = note.label.thing;
      row.opacity = note.opacity;
    });
  }
  const auto count = static_cast<py::ssize_t>(rows.size());
  return array_of(std::move(rows), {count});
}

/// Classes and things of surfels by their words.
py::tuple labels_of(const MapObject& object, const Array<std::uint32_t>& words) {
  if (words.ndim() != 1) throw py::value_error("surfels: (n,) is wanted");
  std::vector<std::uint8_t> kinds;
  std::vector<std::uint32_t> things;
  for (py::ssize_t i = 0; i < words.shape(0); ++i) {
    const SurfelLabel label = object.map->notes().label(words.at(i));
    kinds.push_back(label.kind);
    things.push_back(label.thing);
  }
  const py::ssize_t count = words.shape(0);
  return py::make_tuple(array_of(std::move(kinds), {count}), array_of(std::move(things), {count}));
}

/// (k, 3); none if no position is free.
py::array_t<double> tour_of(const MapObject& object,
                            double length,
                            double radius,
                            double margin,
                            const std::optional<std::vector<double>>& start) {
  if (!(length > 0.0 && length < 1e6 && radius > 0.0 && radius + margin > 0.0 && margin < 1e3)) {
    throw py::value_error("tour: a length and a radius above 0 are wanted, in m");
  }
  TourOptions options;
  options.length_min = length;
  options.radius = radius;
  options.margin = margin;
  if (start) {
    if (start->size() != 3) throw py::value_error("start: (3,) is wanted");
    options.start = Vector3d((*start)[0], (*start)[1], (*start)[2]);
    if (!options.start->allFinite()) throw py::value_error("start: finite numbers are wanted");
  }
  std::optional<Tour> tour;
  {
    const py::gil_scoped_release unlocked;
    tour = find_tour(*object.map, options, *executor());
  }
  std::vector<double> rows;
  if (tour) {
    for (const Vector3d& p : tour->points_world) rows.insert(rows.end(), {p.x(), p.y(), p.z()});
  }
  const auto count = static_cast<py::ssize_t>(rows.size() / 3);
  return array_of(std::move(rows), {count, 3});
}

}  // namespace

void add_map(py::module_& module) {
  PYBIND11_NUMPY_DTYPE_EX(SurfelRow,
                          center,
                          "center",
                          normal,
                          "normal",
                          axis,
                          "axis",
                          sigmas,
                          "sigmas",
                          intensity,
                          "intensity",
                          word,
                          "word",
                          assumed,
                          "assumed",
                          kind,
                          "class",
                          opacity,
                          "opacity",
                          thing,
                          "thing");
  py::class_<MapObject, std::shared_ptr<MapObject>>(module, "Map")
      .def_static("_open", &open_map, py::arg("path"))
      .def_static("_import_clouds",
                  &import_clouds_as_map,
                  py::arg("clouds"),
                  py::arg("output"),
                  py::arg("resolution"),
                  py::arg("name"),
                  py::arg("progress"))
      .def_property_readonly("name", [](const MapObject& m) { return m.map->name(); })
      .def_property_readonly("resolution", [](const MapObject& m) { return m.map->resolution(); })
      .def_property_readonly("bounds", &bounds_of)
      .def_property_readonly("hash", [](const MapObject& m) { return m.map->hash(); })
      .def_property_readonly("has_intensity",
                             [](const MapObject& m) { return m.map->has_intensity(); })
      .def_property_readonly("file_size", [](const MapObject& m) { return m.map->file_size(); })
      .def_property_readonly("_metadata",
                             [](const MapObject& m) { return std::string(m.map->metadata()); })
      .def_property_readonly("words",
                             [](const py::object& self) {
                               const auto& map = self.cast<const MapObject&>();
                               return view_of(map.map->words(), self);
                             })
      .def("__len__", [](const MapObject& m) { return m.map->surfel_count(); })
      .def("_nearest", &nearest_to, py::arg("points"), py::arg("reach"))
      .def("_surfels", &surfels_of)
      .def_property_readonly("classes",
                             [](const MapObject& m) { return m.map->notes().class_names(); })
      .def("_labels", &labels_of, py::arg("surfels"))
      .def("_tour",
           &tour_of,
           py::arg("length"),
           py::arg("radius"),
           py::arg("margin"),
           py::arg("start"))
      .def("verify", [](const MapObject& m) {
        const py::gil_scoped_release unlocked;
        m.map->verify();
      });
}

}  // namespace pointflight::python
