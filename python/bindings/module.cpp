#include <pybind11/pybind11.h>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/core/version.hpp"
#include "pointflight/gpu/gpu_renderer.hpp"
#include "python/bindings/map_object.hpp"
#include "python/bindings/run_objects.hpp"
#include "python/bindings/work.hpp"

namespace pointflight::python {
namespace {

namespace py = pybind11;

void add_all(py::module_& module) {
  module.doc() = "Compiled part of pointflight.";
  add_gpu_renderer();
  module.attr("__version__") = kVersion;
  py::register_exception<InputError>(module, "InputError", PyExc_ValueError).doc() =
      "Something outside the program is wrong: a file, a name, a value. One line that says what, "
      "where, and what would do.";
  module.def("set_threads",
             &set_threads,
             py::arg("threads"),
             "Work runs on so many threads from now on; 0: all cores, as at the start. Results do "
             "not depend on it.");
  module.def(
      "threads", [] { return executor()->threads(); }, "How many threads work runs on.");
  module.def("_add_data_folder", &add_data_folder, py::arg("folder"));
  add_map(module);
  add_rays(module);
  add_lidar(module);
  add_settings(module);
  add_commands(module);
  add_samples(module);
  add_simulation(module);
  add_parts(module);
  add_flights(module);
  add_fidelity(module);
}

}  // namespace
}  // namespace pointflight::python

PYBIND11_MODULE(_pointflight, module) {
  pointflight::python::add_all(module);
}
