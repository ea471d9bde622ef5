// Sensors: their beams, and scans of a map.
#include "pointflight/lidar/lidar.hpp"

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "pointflight/core/settings.hpp"
#include "pointflight/core/settings_json.hpp"
#include "pointflight/lidar/scan.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/map_object.hpp"
#include "python/bindings/run_objects.hpp"
#include "python/bindings/work.hpp"

namespace pointflight::python {
namespace {

/// A sensor file as Python holds it; its beams are found once.
class LidarObject {
 public:
  explicit LidarObject(const std::string& name)
      : settings_(load_lidar(name)), beams_(std::make_shared<const ScanBeams>(settings_)) {}

  [[nodiscard]] const LidarSettings& settings() const { return settings_; }

  /// The scan's rows, and names, kinds and sizes of their fields.
  [[nodiscard]] py::tuple scan(const MapObject& object,
                               const Array<double>& pose,
                               std::uint64_t seed,
                               std::uint32_t index,
                               bool noise,
                               bool truth,
                               double sun_klx,
                               double reflectivity) const {
    if (!(reflectivity >= 0.0 && reflectivity <= 1.0)) {
      throw py::value_error("reflectivity: 0 (as the map says, or varied) to 1");
    }
    if (!(sun_klx >= 0.0 && sun_klx <= 200.0)) throw py::value_error("sun_klx: 0 to 200");
    const Pose T_world_sensor = pose_from(pose, "pose");
    Surroundings where;
    where.sun_klx = sun_klx;
    where.reflectivity = reflectivity;
    Scan scan;
    {
      const py::gil_scoped_release unlocked;
      const Lidar lidar(settings_, 0, beams_, surroundings_in(*object.map, where));
      ScanRequest request;
      request.index = index;
      request.start = SimTime(static_cast<std::int64_t>(index) * lidar.period());
      request.noise = noise;
      request.seed = seed;
      request.truth = truth;
      request.map = object.map.get();
      scan = lidar.take(request, PoseTrack(T_world_sensor), *object.beams, *executor());
    }
    return rows_of_scan(scan);
  }

  /// Of the scan with this index and seed: directions (n, 3), times (n,) after its start, rings
  /// (n,).
  [[nodiscard]] py::tuple beams(std::uint64_t seed, std::uint32_t index) const {
    const Lidar lidar(settings_, 0, beams_, Surroundings{});
    const std::vector<Beam> all = lidar.beams(lidar.pattern_scan(index, seed), *executor());
    std::vector<float> directions;
    std::vector<double> times;
    std::vector<std::uint16_t> rings;
    for (const Beam& beam : all) {
      for (int k = 0; k < 3; ++k) directions.push_back(beam.direction_sensor[k]);
      times.push_back(to_seconds(beam.time_offset));
      rings.push_back(beam.ring);
    }
    const auto n = static_cast<py::ssize_t>(all.size());
    return py::make_tuple(array_of(std::move(directions), {n, 3}),
                          array_of(std::move(times), {n}),
                          array_of(std::move(rings), {n}));
  }

  /// The sensor file as YAML, every key in it.
  [[nodiscard]] std::string text() const {
    LidarSettings written = settings_;
    SettingsWriter writer;
    describe(writer, written);
    return writer.text();
  }

  /// The same as JSON.
  [[nodiscard]] std::string json() const {
    LidarSettings written = settings_;
    SettingsJson visitor;
    describe(visitor, written);
    return visitor.text();
  }

 private:
  LidarSettings settings_;
  std::shared_ptr<const ScanBeams> beams_;
};

}  // namespace

py::tuple rows_of_scan(const Scan& scan) {
  py::list fields;
  for (const PcdField& field : scan_fields(scan.marks)) {
    fields.append(py::make_tuple(
        field.name, std::string(1, field.type == 'F' ? 'f' : 'u') + std::to_string(field.size)));
  }
  const std::size_t size = scan.points.size() * scan_row_size(scan.marks);
  py::array_t<std::uint8_t> rows(static_cast<py::ssize_t>(size));
  write_scan_rows(scan, std::as_writable_bytes(std::span(rows.mutable_data(), size)));
  return py::make_tuple(rows, fields, scan.beams);
}

void add_lidar(py::module_& module) {
  py::class_<LidarObject, std::shared_ptr<LidarObject>>(module, "_Lidar")
      .def(py::init<const std::string&>(), py::arg("name"))
      .def_property_readonly("title", [](const LidarObject& l) { return l.settings().title; })
      .def_property_readonly("rate", [](const LidarObject& l) { return l.settings().rate; })
      .def_property_readonly("text", &LidarObject::text)
      .def_property_readonly("json", &LidarObject::json)
      .def("scan",
           &LidarObject::scan,
           py::arg("map"),
           py::arg("pose"),
           py::arg("seed"),
           py::arg("index"),
           py::arg("noise"),
           py::arg("truth"),
           py::arg("sun_klx"),
           py::arg("reflectivity"))
      .def("beams", &LidarObject::beams, py::arg("seed"), py::arg("index"));
}

}  // namespace pointflight::python
