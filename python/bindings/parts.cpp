// Parts of runs that are written in Python: rows of the tables of controllers, sensors and
// renderers.
#include <pybind11/stl.h>

#include <any>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "pointflight/render/renderer.hpp"
#include "pointflight/sim/sensor.hpp"
#include "pointflight/sim/vehicle_agent.hpp"
#include "pointflight/vehicle/controller.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/map_object.hpp"
#include "python/bindings/run_objects.hpp"
#include "python/bindings/work.hpp"

namespace pointflight::python {
namespace {

using Held = std::shared_ptr<py::object>;

/// What a Python object remembers, in C++'s memory; None at first.
py::object memory_in(const std::any& memory) {
  const auto* kept = std::any_cast<Held>(&memory);
  return kept != nullptr ? **kept : py::object(py::none());
}

/// Flies by a Python function of (state, setpoint, dt, memory).
class PythonController : public Controller {
 public:
  PythonController(Held update, std::size_t rotors)
      : update_(std::move(update)), rotors_(static_cast<py::ssize_t>(rotors)) {}

  [[nodiscard]] std::vector<double> update(const RigidBodyState& state,
                                           const Setpoint& setpoint,
                                           double dt,
                                           ControllerMemory& memory) const override {
    const py::gil_scoped_acquire lock;
    const py::object asked = std::visit([](const auto& one) { return py::cast(one); }, setpoint);
    const py::object answer = (*update_)(state, asked, dt, memory_in(memory.own));
    if (!py::isinstance<py::tuple>(answer) || py::len(answer) != 2) {
      throw py::type_error("update: rotor speeds and the memory are wanted, a pair");
    }
    const auto speeds = py::cast<Array<double>>(py::tuple(answer)[0]);
    require_shape(speeds, "rotor speeds", {rotors_});
    memory.own = held(py::tuple(answer)[1]);
    return {speeds.data(), speeds.data() + speeds.size()};
  }

 private:
  Held update_;
  py::ssize_t rotors_;
};

void add_controller(const std::string& name,
                    const std::string& help,
                    const py::object& make,
                    double tilt_max_deg) {
  ControllerKind::table().add(
      {.name = name,
       .help = help,
       .make =
           [make = held(make)](const VehicleSettings& settings) {
             const py::gil_scoped_acquire lock;
             const py::object update = (*make)(std::make_shared<VehicleSettings>(settings));
             return std::make_unique<PythonController>(held(update), settings.rotors.size());
           },
       .integrates_attitude = false,
       .tilt_max_deg = tilt_max_deg});
}

/// One of the table's controllers, for those that are built on it.
class ControllerObject {
 public:
  ControllerObject(const std::string& name, const VehicleSettings& settings)
      : controller_(make_controller(name, settings)) {}

  [[nodiscard]] py::tuple update(const RigidBodyState& state,
                                 const Setpoint& setpoint,
                                 double dt,
                                 const std::optional<ControllerMemory>& memory) const {
    ControllerMemory later = memory.value_or(ControllerMemory{});
    std::vector<double> speeds = controller_->update(state, setpoint, dt, later);
    const auto count = static_cast<py::ssize_t>(speeds.size());
    return py::make_tuple(array_of(std::move(speeds), {count}), std::move(later));
  }

 private:
  std::unique_ptr<Controller> controller_;
};

/// Numbers that a scenario may give to a sensor.
struct SensorValues {
  double rate = 10.0;                    ///< Hz
  std::map<std::string, double> others;  ///< By key.
};

/// What a sensor in Python looks at.
struct SensorInput {
  double time = 0.0;
  std::int64_t index = 0;
  RigidBodyState state;
  std::vector<double> rotor_speeds;
  std::map<std::string, double> settings;
  py::object memory;
  SensorSite site;
};

/// numpy's, addressed by seed, vehicle, sensor and measurement.
py::object generator_for(const SensorInput& input) {
  const py::module_ random = py::module_::import("numpy.random");
  const py::tuple words = py::make_tuple(input.site.seed,
                                         input.site.vehicle,
                                         input.site.sensor,
                                         static_cast<std::uint64_t>(input.index));
  return random.attr("Generator")(random.attr("Philox")(random.attr("SeedSequence")(words)));
}

class PythonSensor : public InstantSensor {
 public:
  PythonSensor(const SensorSite& site,
               Held function,
               const SensorValues& values,
               std::size_t columns)
      : InstantSensor(values.rate),
        site_(site),
        function_(std::move(function)),
        settings_(values.others),
        columns_(static_cast<py::ssize_t>(columns)) {}

  [[nodiscard]] Sample measure(const InstantInput& input, std::any& memory) const override {
    const py::gil_scoped_acquire lock;
    auto seen = std::make_shared<SensorInput>();
    seen->time = to_seconds(input.time);
    seen->index = input.index;
    seen->state = input.state.body;
    for (const RotorState& rotor : input.state.rotors) seen->rotor_speeds.push_back(rotor.speed);
    seen->settings = settings_;
    seen->memory = memory_in(memory);
    seen->site = site_;
    const auto values = py::cast<Array<double>>((*function_)(seen));
    require_shape(values, "measurement", {columns_});
    memory = held(seen->memory);
    return Measurement{site_.vehicle,
                       site_.sensor,
                       input.time,
                       input.time,
                       {values.data(), values.data() + values.size()}};
  }

 private:
  SensorSite site_;
  Held function_;
  std::map<std::string, double> settings_;
  py::ssize_t columns_;
};

void add_sensor(const std::string& name,
                const std::string& help,
                const std::vector<std::pair<std::string, std::string>>& columns,
                double rate,
                const std::map<std::string, double>& settings,
                const py::object& measure) {
  SensorKind kind;
  kind.name = name;
  kind.help = help;
  for (const auto& [column, unit] : columns) kind.columns.push_back({column, unit});
  kind.settings = SensorValues{rate, settings};
  kind.describe = [](SettingsVisitor& visitor, std::any& described) {
    auto& values = std::any_cast<SensorValues&>(described);
    visitor.value({"rate", "Hz", "measurements per second", 0.1, 1000}, values.rate);
    for (auto& [key, value] : values.others) visitor.value({key, "", "of its own"}, value);
  };
  kind.make = [measure = held(measure), count = kind.columns.size()](const SensorSite& site,
                                                                     const std::any& chosen) {
    return std::make_unique<PythonSensor>(
        site, measure, std::any_cast<const SensorValues&>(chosen), count);
  };
  sensor_kinds().add(std::move(kind));
}

/// Sees what the beam renderer sees, as a Python function changes it.
class PythonRenderer : public Renderer {
 public:
  PythonRenderer(const Scene& scene, Held change)
      : beams_(Choice<RendererKind>("beam")->make(scene)), change_(std::move(change)) {}

 protected:
  void render_one(const RenderJob& job, const Executor& executor) const override {
    beams_->render({&job, 1}, executor);
    const py::gil_scoped_acquire lock;
    const auto count = static_cast<py::ssize_t>(job.hits.size());
    py::array_t<double> origins({count, py::ssize_t{3}});
    py::array_t<float> directions({count, py::ssize_t{3}});
    for (py::ssize_t i = 0; i < count; ++i) {
      const Ray& ray = job.batch.rays[static_cast<std::size_t>(i)];
      for (int k = 0; k < 3; ++k) {
        origins.mutable_at(i, k) = ray.origin_world[k];
        directions.mutable_at(i, k) = ray.direction_world[k];
      }
    }
    const py::array_t<Hit> hits(count, job.hits.data());  // a copy: it may be kept
    const py::object answer = (*change_)(origins, directions, hits);
    const auto changed = answer.is_none() ? hits : py::cast<py::array_t<Hit>>(answer);
    require_shape(changed, "hits", {count});
    std::copy_n(changed.data(), count, job.hits.begin());
  }

 private:
  std::unique_ptr<const Renderer> beams_;
  Held change_;
};

void add_renderer(const std::string& name, const std::string& help, const py::object& change) {
  RendererKind::table().add(
      {.name = name, .help = help, .make = [change = held(change)](const Scene& scene) {
         return std::make_unique<PythonRenderer>(scene, change);
       }});
}

}  // namespace

void add_parts(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(Hit, range, cos_incidence, intensity, label, surfel);
  py::class_<ControllerMemory>(
      module, "ControllerMemory", "What a controller remembers from one period to the next.");
  py::class_<ControllerObject>(
      module, "Controller", "One of the controllers, by name: for those that are built on it.")
      .def(py::init<const std::string&, const VehicleSettings&>(),
           py::arg("name"),
           py::arg("vehicle"))
      .def("update",
           &ControllerObject::update,
           py::arg("state"),
           py::arg("setpoint"),
           py::arg("dt"),
           py::arg("memory") = py::none());
  py::class_<SensorInput, std::shared_ptr<SensorInput>>(
      module, "SensorInput", "What a sensor looks at when it measures.")
      .def_readonly("time", &SensorInput::time, "s since the start of the run.")
      .def_readonly("index", &SensorInput::index, "Number of the measurement since time zero.")
      .def_readonly("state", &SensorInput::state, "The true state of its vehicle.")
      .def_property_readonly(
          "rotor_speeds",
          [](const SensorInput& i) {
            return py::array_t<double>(static_cast<py::ssize_t>(i.rotor_speeds.size()),
                                       i.rotor_speeds.data());
          },
          "(n,): rad/s.")
      .def_readonly("settings", &SensorInput::settings, "Its keys, as the scenario has them.")
      .def_readwrite("memory",
                     &SensorInput::memory,
                     "Whatever it remembers from one measurement to the next: assign a new object, "
                     "states of the run keep the old one. None at first.")
      .def("random", &generator_for, "numpy's generator, addressed by seed and measurement.");
  module.def("_add_controller",
             &add_controller,
             py::arg("name"),
             py::arg("help"),
             py::arg("make"),
             py::arg("tilt_max_deg"));
  module.def("_add_sensor",
             &add_sensor,
             py::arg("name"),
             py::arg("help"),
             py::arg("columns"),
             py::arg("rate"),
             py::arg("settings"),
             py::arg("measure"));
  module.def("_add_renderer", &add_renderer, py::arg("name"), py::arg("help"), py::arg("change"));
}

}  // namespace pointflight::python
